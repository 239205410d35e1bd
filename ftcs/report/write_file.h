// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ftcs {

/// Why a file could not be written, for people: "cannot write report.html: No space left on
/// device".
struct WriteError {
  std::string message;
};

/// Writes the whole content or nothing: into a new file `path`.part0 first, which then takes the
/// place of `path`, so that a full disk leaves an older result as it was. If that name is taken, by
/// a file or a link that somebody laid there, part1 and so on. What exists and is no regular file
/// (a device, a pipe) is written to directly. No value: done.
[[nodiscard]] std::optional<WriteError> write_file(const std::filesystem::path& path,
                                                   std::string_view content);

/// Before a long run: would write_file() fail here already now? Nothing that exists is touched. A
/// disk can still fill up until then; a device or a pipe is not tried.
[[nodiscard]] std::optional<WriteError> check_writable(const std::filesystem::path& path);

/// A file of the command line and what names it there: "--json", "FILE". Of a result, an empty path
/// is none and "-" the standard output; of an input, "-" is the standard input.
struct NamedFile {
  std::string option;
  std::filesystem::path path;
};

/// Would a result take the place of an input or of another result? Links and other spellings of a
/// path are the same file; what is no regular file (a device, a pipe) takes any number of results.
[[nodiscard]] std::optional<WriteError> check_distinct(const std::vector<NamedFile>& results,
                                                       const std::vector<NamedFile>& inputs);

}  // namespace ftcs
