#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flips signs and comparisons one at a time; every mutant must fail a test of its own layer.

Signs: + -, += -=, ++ --, unary minus. Comparisons: < > <= >= == !=, && ||, negation, true false, min max. Sources are the
.h and .cpp files of the layers, tests excepted. Folders inside a layer are judged by statistics and not by exact results,
and are left out unless --deep is given. Of each mutant only the objects that see it are compiled, and the tests run until
one fails, the file's own test first, then the quickest. Prints one line per mutant; exits with 1 if one survives.

A mutant that computes the same is listed with the reason in tools/mutation_equivalents.txt. An entry that no
longer fits any mutant is an error as well.
"""

import argparse
import concurrent.futures
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LAYERS = ["clock", "measurement", "servo"]
EQUIVALENTS = ROOT / "tools" / "mutation_equivalents.txt"
FLAGS = ["-std=c++20", "-O1", "-w", "-ffp-contract=off"]
# An endless loop is a mutant found: a test program that takes so many times as long as it should never ends.
PATIENCE = 10

# Binary operators stand between spaces (clang-format), template brackets and references never do.
RULES = [
    (r" (\+) ", ["-"]),
    (r" (-) ", ["+"]),
    (r" (\+=) ", ["-="]),
    (r" (-=) ", ["+="]),
    (r"(\+\+)", ["--"]),
    (r"(--)", ["++"]),
    (r"(?:[(,=?:{<>&|*/] ?|return )(-)(?=[A-Za-z_(0-9])", ["+"]),
    (r" (<) ", ["<=", ">"]),
    (r" (>) ", [">=", "<"]),
    (r" (<=) ", ["<", ">="]),
    (r" (>=) ", [">", "<="]),
    (r" (==) ", ["!="]),
    (r" (!=) ", ["=="]),
    (r" (&&) ", ["||"]),
    (r" (\|\|) ", ["&&"]),
    (r"(!)(?=[A-Za-z_(])", [""]),
    (r"\b(true)\b", ["false"]),
    (r"\b(false)\b", ["true"]),
    (r"\bstd::(min)\(", ["max"]),
    (r"\bstd::(max)\(", ["min"]),
    (r"\b(min_element)\b", ["max_element"]),
    (r"\b(max_element)\b", ["min_element"]),
]


class Mutant:
    def __init__(self, path, line, before, after, text, source):
        self.path = path      # relative to the root
        self.line = line      # counted from 1
        self.before = before
        self.after = after
        self.text = text      # the mutated line
        self.source = source  # the mutated file

    def __str__(self):
        return f"{self.path}:{self.line}"


def blank_out(code):
    """The same text with comments, literals and preprocessor lines replaced by as many spaces."""
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])\'(?:\\.|[^\'\\\n])\'|^[ ]*#[^\n]*'
    blank = lambda match: re.sub(r"[^\n]", " ", match.group())
    return re.sub(pattern, blank, code, flags=re.DOTALL | re.MULTILINE)


def mutants_of(path):
    code = (ROOT / path).read_text()
    visible = blank_out(code)
    found = []
    for pattern, replacements in RULES:
        for match in re.finditer(pattern, visible):
            begin, end = match.span(1)
            line_begin = code.rfind("\n", 0, begin) + 1
            line_end = code.find("\n", end)
            # An operator function's name is no operation, and a static assertion is no program.
            if re.search(r"operator\s*$|static_assert", visible[line_begin:begin]):
                continue
            for replacement in replacements:
                source = code[:begin] + replacement + code[end:]
                text = (code[line_begin:begin] + replacement + code[end:line_end]).strip()
                line = code.count("\n", 0, begin) + 1
                found.append(((begin, replacement), Mutant(path, line, match.group(1), replacement, text, source)))
    return [mutant for _, mutant in sorted(found, key=lambda item: item[0])]


def read_equivalents():
    """Blocks of three lines: the file, the mutated line, `because:` and the reason."""
    entries = {}
    if not EQUIVALENTS.exists():
        return entries
    lines = [line.rstrip() for line in EQUIVALENTS.read_text().splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    for path, text, reason in zip(lines[0::3], lines[1::3], lines[2::3]):
        if not reason.strip().startswith("because:"):
            sys.exit(f"{EQUIVALENTS.name}: no reason given for {path}: {text.strip()}")
        entries[(path, text.strip())] = reason.strip()
    return entries


class Layer:
    """The objects and test programs of a layer, built without a build system."""

    def __init__(self, name, scratch, compiler, deep):
        self.name = name
        self.compiler = compiler
        self.scratch = scratch / name
        self.scratch.mkdir(parents=True)
        text = (ROOT / "ftcs" / name / "CMakeLists.txt").read_text()
        text = re.sub(r"#[^\n]*|\$\{[^}]*\}", "", text)
        folder = ROOT / "ftcs" / name
        self.tests = {}
        for body in re.findall(r"ftcs_layer\((.*?)\)", text, re.DOTALL):
            for test in self.words(body, "TESTS"):
                self.tests[folder / test] = [name]
        for body in re.findall(r"ftcs_test\((.*?)\)", text, re.DOTALL):
            if "LABEL slow" not in body:
                self.tests[folder / body.split()[0]] = self.words(body, "DEPENDS")
        self.sources = sorted(p for p in folder.rglob("*.cpp") if not p.stem.endswith("_test"))
        self.files = sorted(p.relative_to(ROOT) for p in [*folder.rglob("*.h"), *self.sources]
                            if deep or p.parent == folder)
        self.objects = {}
        self.seconds = {}
        self.seen = {}

    @staticmethod
    def words(body, keyword):
        match = re.search(keyword + r"\s+((?:[a-z0-9_./]+\s*)+)", body)
        return match.group(1).split() if match else []

    @staticmethod
    def closure(names):
        done = []
        todo = list(names)
        while todo:
            name = todo.pop()
            if name in done:
                continue
            done.append(name)
            text = (ROOT / "ftcs" / name / "CMakeLists.txt").read_text()
            body = re.search(r"ftcs_layer\((.*?)\)", text, re.DOTALL).group(1)
            todo += Layer.words(body, "DEPENDS")
        return done

    def linked(self, test):
        return [p for name in self.closure(self.tests[test])
                for p in sorted((ROOT / "ftcs" / name).rglob("*.cpp")) if not p.stem.endswith("_test")]

    def compile(self, source, target, overlay=None):
        where = (overlay or ROOT) / source.relative_to(ROOT)
        if not where.exists():
            where = source
        includes = [f"-I{overlay}"] if overlay else []
        command = [self.compiler, *FLAGS, *includes, f"-I{ROOT}", "-include", str(self.scratch.parent / "all.h"),
                   "-MMD", "-MF", f"{target}.d", "-c", str(where), "-o", str(target)]
        done = subprocess.run(command, capture_output=True, text=True)
        return None if done.returncode == 0 else done.stderr

    def link_and_run(self, objects, program, seconds=600.0):
        command = [self.compiler, *map(str, objects), "-o", str(program), "-lgtest_main", "-lgtest", "-lpthread"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{program.name} does not link:\n{done.stderr}")
        try:
            done = subprocess.run([str(program), "--gtest_brief=1"], capture_output=True, text=True, cwd=ROOT,
                                  env={**os.environ, "GTEST_FAIL_FAST": "1"}, timeout=seconds)
        except subprocess.TimeoutExpired:
            return "it never ends"
        if done.returncode == 0:
            return None
        match = re.search(r"\[  FAILED  \] (\S+)", done.stdout)
        return match.group(1) if match else (done.stderr.strip().splitlines() or ["it crashes"])[-1]

    def build(self, pool):
        support = ROOT / "test" / "support" / "forbid_allocation.cpp"
        wanted = {support, *self.tests}
        for test in self.tests:
            wanted.update(self.linked(test))
        jobs = {}
        for source in sorted(wanted):
            target = self.scratch / (str(source.relative_to(ROOT)).replace("/", "_") + ".o")
            self.objects[source] = target
            jobs[source] = pool.submit(self.compile, source, target)
        for source, job in jobs.items():
            if job.result() is not None:
                sys.exit(f"{source} does not compile:\n{job.result()}")
            dependencies = Path(f"{self.objects[source]}.d").read_text().replace("\\\n", " ").split()[1:]
            self.seen[source] = {os.path.realpath(d) for d in dependencies}
        for test in self.tests:
            objects = [self.objects[test], *(self.objects[s] for s in self.linked(test)), self.objects[support]]
            begin = time.monotonic()
            failure = self.link_and_run(objects, self.scratch / test.stem)
            self.seconds[test] = time.monotonic() - begin
            if failure is not None:
                sys.exit(f"{test.relative_to(ROOT)} fails without any mutation: {failure}")

    def judge(self, mutant):
        """What found the mutant, or None."""
        mutated = os.path.realpath(ROOT / mutant.path)
        with tempfile.TemporaryDirectory(dir=self.scratch) as folder:
            overlay = Path(folder) / "tree"
            (overlay / mutant.path).parent.mkdir(parents=True)
            (overlay / mutant.path).write_text(mutant.source)
            fresh = {}
            own = mutant.path.stem + "_test"
            ranked = sorted((t for t in self.tests if any(mutated in self.seen[s] for s in [t, *self.linked(t)])),
                            key=lambda t: (t.stem != own, self.seconds[t]))
            # What a header's own test finds in its own copy of the header needs no other object anew.
            if mutant.path.suffix == ".h" and ranked and ranked[0].stem == own:
                failure = self.run_mutated(ranked[0], [ranked[0]], Path(folder), overlay, fresh)
                if failure is not None:
                    return failure
            for test in ranked:
                sources = [s for s in [test, *self.linked(test)] if mutated in self.seen[s]]
                failure = self.run_mutated(test, sources, Path(folder), overlay, fresh)
                if failure is not None:
                    return failure
        return None

    def run_mutated(self, test, affected, folder, overlay, fresh):
        """Runs a test with the affected sources compiled anew, all others as they were built first."""
        support = ROOT / "test" / "support" / "forbid_allocation.cpp"
        for source in affected:
            if source not in fresh:
                target = folder / self.objects[source].name
                if self.compile(source, target, overlay) is not None:
                    return "the compiler"
                fresh[source] = target
        objects = [fresh.get(s, self.objects[s]) for s in [test, *self.linked(test), support]]
        return self.link_and_run(objects, folder / "program", 10.0 + PATIENCE * self.seconds[test])


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--layer", action="append", choices=LAYERS, help="only this layer; may be repeated")
    parser.add_argument("--file", help="only files whose path contains this")
    parser.add_argument("--deep", action="store_true", help="folders inside the layers too")
    parser.add_argument("--shard", default="1/1", help="i/n: every n-th mutant, from the i-th on")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--compiler", default=os.environ.get("CXX", "c++"))
    parser.add_argument("--list", action="store_true", help="print the mutants and run nothing")
    return parser.parse_args()


def choose(layer, arguments, equivalents):
    mutants = [m for path in layer.files if not arguments.file or arguments.file in str(path)
               for m in mutants_of(path)]
    if arguments.file is None:
        known = {(str(m.path), m.text) for m in mutants}
        stale = [e for e in equivalents if e[0].startswith(f"ftcs/{layer.name}/") and e not in known]
        for path, text in stale:
            print(f"{path}: no mutant reads `{text}` (stale entry of {EQUIVALENTS.name})")
        if stale:
            sys.exit(1)
    index, count = map(int, arguments.shard.split("/"))
    return mutants[index - 1::count]


def run_layer(layer, arguments, equivalents, tally):
    mutants = choose(layer, arguments, equivalents)
    if arguments.list:
        for mutant in mutants:
            print(f"{mutant}: `{mutant.before}` -> `{mutant.after}`: {mutant.text}")
        return
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        layer.build(pool)
        jobs = []
        for mutant in mutants:
            known = (str(mutant.path), mutant.text) in equivalents
            jobs.append((mutant, None if known else pool.submit(layer.judge, mutant)))
        for mutant, job in jobs:
            change = f"{str(mutant):58} {mutant.before:>4} -> {mutant.after or 'none':4}"
            if job is None:
                tally["equivalent"] += 1
                print(f"{change} equivalent", flush=True)
                continue
            killer = job.result()
            if killer is None:
                tally["survived"] += 1
                print(f"{change} SURVIVED: {mutant.text}", flush=True)
            else:
                tally["compiler" if killer == "the compiler" else "killed"] += 1
                print(f"{change} killed by {killer}", flush=True)


def take_snapshot(scratch):
    """A copy of the sources, so that they may be edited meanwhile."""
    global ROOT
    for part in ["ftcs", "test/support"]:
        shutil.copytree(ROOT / part, scratch / "tree" / part)
    ROOT = scratch / "tree"


def main():
    arguments = parse_arguments()
    equivalents = read_equivalents()
    tally = {"killed": 0, "compiler": 0, "equivalent": 0, "survived": 0}
    scratch = Path(tempfile.mkdtemp(prefix="ftcs-mutate-"))
    try:
        take_snapshot(scratch)
        # The test framework is most of what is compiled: once is enough.
        (scratch / "all.h").write_text("#include <gtest/gtest.h>\n#include <random>\n#include <cmath>\n")
        if not arguments.list:
            subprocess.run([arguments.compiler, *FLAGS, "-x", "c++-header", str(scratch / "all.h")], check=True)
        for name in arguments.layer or LAYERS:
            run_layer(Layer(name, scratch, arguments.compiler, arguments.deep), arguments, equivalents, tally)
    finally:
        shutil.rmtree(scratch)
    if arguments.list:
        return 0
    print(f"{sum(tally.values())} mutants: {tally['killed']} killed by tests, {tally['compiler']} by the compiler, "
          f"{tally['equivalent']} equivalent, {tally['survived']} survived")
    return 1 if tally["survived"] else 0


if __name__ == "__main__":
    sys.exit(main())
