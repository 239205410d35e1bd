#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The table of docs/real-clocks.md from the results of the jobs: ours beside ptp4l and phc2sys, by the true error.

  test/vm/table.py [build/vm/results]

First `make test-vm` (and `test/vm/run busy_peer`). A cell: seconds until the error stays within the band (100 ns, with noise 1 us); then RMS,
mean, worst in ns over what the job counts: the second half of the run where it says nothing else.
"""
import pathlib
import re
import sys

CASES = [  # job, what a file is named after its program, what it is
    ("transports", "2E", "L2, E2E"),
    ("transports", "2P", "L2, P2P"),
    ("transports", "4E", "UDPv4, E2E"),
    ("transports", "4P", "UDPv4, P2P"),
    ("transports", "6E", "UDPv6, E2E"),
    ("transports", "6P", "UDPv6, P2P"),
    ("gptp", "gptp", "gPTP, 300 ns of link"),
    ("noise", "noise_8", "100 ns of noise, 8 a second"),
    ("noise", "noise_1", "100 ns of noise, 1 a second"),
    ("coarse", "coarse", "the same at 8, rate in steps of 119 ppb, stamps of 8 ns"),
    ("coarse", "coarse_told", "the same, told by `--frequency-granularity`"),
    ("busy", "busy", "four busy processes"),
    ("system", "system", "CLOCK_REALTIME, software stamps"),
    ("phc", "precise_1", "CLOCK_REALTIME by PRECISE, 1 a second"),
    ("phc", "precise_8", "CLOCK_REALTIME by PRECISE, 8 a second"),
    ("phc", "extended_1", "CLOCK_REALTIME by EXTENDED, 1 a second"),
    ("phc", "extended_8", "CLOCK_REALTIME by EXTENDED, 8 a second"),
    ("phc", "basic_1", "CLOCK_REALTIME by basic readings, 1 a second"),
    ("phc", "basic_8", "CLOCK_REALTIME by basic readings, 8 a second"),
    ("phc", "phc_phc", "a hardware clock by another"),
    ("readings", "phc_wide", "CLOCK_REALTIME, one reading in ten interrupted for 3 ms"),
]
PROGRAMS = ["ftcs", "ptp4l", "linreg", "phc2sys"]


def cell(path):
    if not path.exists():
        return ""
    line = path.read_text()
    found = {name: re.search(rf" {name}=(-?[0-9.inf]+)", line) for name in ("lock", "rms", "mean", "worst")}
    if not all(found.values()):
        return "?"
    value = {name: match.group(1) for name, match in found.items()}
    lock = "not" if value["lock"] == "inf" else f"{float(value['lock']):.1f} s"
    return f"{lock}; {value['rms']}, {value['mean']}, {float(value['worst']):.0f}"


def main():
    results = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/vm/results")
    if not results.is_dir():
        sys.exit(f"{results}: no such folder; expected the results of make test-vm")
    print("| job | ours | ptp4l | ptp4l linreg | phc2sys |")
    print("|---|---|---|---|---|")
    for job, case, title in CASES:
        cells = []
        for program in PROGRAMS:
            path = results / job / f"{program}_{case}.judged"
            if not path.exists():
                path = results / f"{job}_peer" / f"{program}_{case}.judged"
            cells.append(cell(path))
        if any(cells):
            print(f"| {title} | " + " | ".join(cells) + " |")


main()
