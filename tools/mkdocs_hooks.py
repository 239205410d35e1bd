# SPDX-License-Identifier: MIT
"""Of mkdocs: links that lead out of docs/ are for readers of the repository; on the site they name the file instead."""
import posixpath
import re

LINK = re.compile(r"\[([^\]]*)\]\((\.\.?/[^)#]*)(#[^)]*)?\)")


def on_page_markdown(markdown, page, **ignored):
    folder = posixpath.join("docs", posixpath.dirname(page.file.src_path))

    def named(match):
        path = posixpath.normpath(posixpath.join(folder, match.group(2)))
        return match.group(0) if path.startswith("docs/") else f"{match.group(1)} (`{path}`)"

    return LINK.sub(named, markdown)
