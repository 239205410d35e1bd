#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""without.py BUILD [NAME...] | without.py --texts: takes one mechanism of the estimator out after the other
(mechanisms.toml: a piece of its source and what stands in its place), compiles what that changes beside the build, and runs the test or the scenario that is said to need it. That must fail.
What ships has no switches for it. --texts: only whether each piece stands in its source, once."""
import concurrent.futures
import os
import re
import shlex
import subprocess
import sys
import tempfile
import tomllib

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
# Whose functions are the estimator's own; other objects do not call into its headers.
PARTS = {"layer/estimation/CMakeFiles/ftcs_estimation.dir/": "estimation", "layer/servo/CMakeFiles/ftcs_servo.dir/adaptive/": "servo"}


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


class Build:
    """What an existing build knows of its objects."""

    def __init__(self, folder):
        self.folder = os.path.realpath(folder)
        self.users = {}  # source or header -> objects
        for block in output("ninja", "-C", self.folder, "-t", "deps").split("\n\n"):
            first, *lines = block.split("\n")
            for line in lines:
                self.users.setdefault(os.path.realpath(os.path.join(self.folder, line.strip())), []).append(first.split(":")[0])
        self.last = {}

    def command(self, target):
        """What makes `target`, the last of the commands that lead to it."""
        if target not in self.last:
            self.last[target] = output("ninja", "-C", self.folder, "-t", "commands", "-s", target).strip()
        return self.last[target]

    def changed(self, file, target):
        """The objects of the program `target` that depend on `file`: its own, and those of the layers that it is linked to."""
        linked = shlex.split(self.command(target))
        layers = [part for part, layer in PARTS.items() if f"layer/{layer}/libftcs_{layer}.a" in linked]
        return [name for name in self.users.get(os.path.join(ROOT, file), []) if name in linked or name.startswith(tuple(layers))]

    def compile(self, name, overlay):
        """The object `name` made anew, headers of `overlay` before those of the project."""
        made = os.path.join(overlay, name.replace("/", "_"))
        words, kept = shlex.split(self.command(name)), []
        source = words[words.index("-c") + 1]
        other = os.path.join(overlay, os.path.relpath(source, ROOT))
        while words:
            word = words.pop(0)
            if word in ("-o", "-MT", "-MF", "-c") or word == "-include":
                words.pop(0)
            elif word not in ("-MD", "-Winvalid-pch", "-Werror"):
                kept.append(word)
        first = next(at for at, word in enumerate(kept) if word.startswith("-"))  # behind the compiler, and ccache where it is
        kept[first:first] = ["-I" + overlay, "-w"]
        subprocess.run([*kept, "-o", made, "-c", other if os.path.exists(other) else source], check=True, cwd=self.folder)
        return made

    def link(self, target, objects, overlay):
        """The program `target` with `objects` in the place of its own and of its libraries'."""
        made = os.path.join(overlay, "program")
        words = shlex.split(self.command(target).removeprefix(": && ").removesuffix(" && :"))
        words[words.index("-o") + 1] = made
        words = [word for word in words if word not in objects]
        at = words.index("-o")
        subprocess.run([*words[:at], *objects.values(), *words[at:]], check=True, cwd=self.folder)
        return made


def read_mechanisms():
    with open(os.path.join(HERE, "mechanisms.toml"), "rb") as file:
        return tomllib.load(file)["mechanism"]


def text_of(mechanism):
    with open(os.path.join(ROOT, mechanism["file"]), encoding="utf-8") as file:
        return file.read()


def stale(mechanisms):
    """What stands in its source not once."""
    counted = ((each, text_of(each).count(each["with"])) for each in mechanisms)
    return [f"{each['name']}: '{each['with']}' stands {count} times in {each['file']}" for each, count in counted if count != 1]


def taken_out(mechanism, overlay):
    path = os.path.join(overlay, mechanism["file"])
    os.makedirs(os.path.dirname(path))
    with open(path, "w", encoding="utf-8") as file:
        file.write(text_of(mechanism).replace(mechanism["with"], mechanism["without"]))


def target_of(needed_by):
    """What a row runs: ftcs, also where a tool of the project calls it, or a test."""
    program = shlex.split(needed_by)[0]
    return "ftcs" if program == "ftcs" or program.startswith("tools/") else f"bin/{program}"


def run(needed_by, program):
    """Its exit code with `program` as what it runs, and the limits and tests that failed."""
    named, *arguments = shlex.split(needed_by)
    command = [os.path.join(ROOT, named), program] if named.startswith("tools/") else [program]
    try:
        ended = subprocess.run([*command, *arguments], cwd=ROOT, capture_output=True, text=True, timeout=900)
    except subprocess.TimeoutExpired:
        return None, "not ended after 900 s"
    said = ended.stdout + ended.stderr
    missed = re.findall(r"^MISSED (?!.*not required).*|(?<=^\[  FAILED  \] )\w+[./][^\s,]+", said, re.M)
    return ended.returncode, "; ".join(dict.fromkeys(missed))[:300]


def passes(build, needed_by):
    """As the program is: what fails anyway shows nothing."""
    return run(needed_by, os.path.join(build.folder, target_of(needed_by)))[0] == 0


def examine(build, mechanism):
    """Whether what needs the mechanism fails without it, and what it says."""
    with tempfile.TemporaryDirectory() as overlay:
        taken_out(mechanism, overlay)
        target = target_of(mechanism["needed_by"])
        objects = {name: build.compile(name, overlay) for name in build.changed(mechanism["file"], target)}
        code, missed = run(mechanism["needed_by"], build.link(target, objects, overlay))
    return code == 1 and missed, missed or f"exit code {code}"


def main():
    mechanisms = read_mechanisms()
    if wrong := stale(mechanisms):
        sys.exit("mechanisms.toml: " + "\n".join(wrong))
    if sys.argv[1:] == ["--texts"]:
        print(f"{len(mechanisms)} mechanisms stand in their sources")
        return 0
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(f"expected a build folder or --texts\n{__doc__}")
    build, names = Build(sys.argv[1]), sys.argv[2:]
    mechanisms = [each for each in mechanisms if not names or any(name in each["name"] for name in names)]
    idle = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        tests = sorted({each["needed_by"] for each in mechanisms})
        failing = [test for test, passed in zip(tests, pool.map(lambda each: passes(build, each), tests)) if not passed]
        if failing:
            sys.exit(f"fails with every mechanism in its place: {'; '.join(failing)}")
        for mechanism, (needed, said) in zip(mechanisms, pool.map(lambda each: examine(build, each), mechanisms)):
            print(f"{'needed' if needed else 'IDLE':6}  {mechanism['name']:52} {said if needed else mechanism['needed_by'] + ' does not fail: ' + said}", flush=True)
            idle += not needed
    print(f"{len(mechanisms)} mechanisms, {idle} that nothing needs")
    return 1 if idle or not mechanisms else 0


if __name__ == "__main__":
    sys.exit(main())
