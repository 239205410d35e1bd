#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Two machines, one time, live: two segments of four drives and two MainDevices as four processes on loopback (UDP
encapsulation, no root), cycle 1 ms, crystals that differ by 60 ppm; plant time is the host's CLOCK_REALTIME. How far the
reference clocks of the two segments stand apart, by the shared clock of the host, for increments of 0x0920 (external and
lead) and for plain writes of 0x0910 as others do them. Arguments: program, seconds a run (default 60)."""
import csv
import os
import subprocess
import sys
import tempfile
import time

FTCS = os.path.realpath(sys.argv[1] if len(sys.argv) > 1 else "build/ftcs")
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
SETTLE = min(30.0, SECONDS / 2)
LIMIT_P50_NS, LIMIT_P99_NS = 2_000, 10_000
WAYS = (("external", "offset", True), ("lead", "offset", True), ("external", "target-time", False),
        ("external", "read-time", False))


def clocks(path, base):
    """Monotonic time and system time less it, ns; whole numbers, less a base: a float does not hold them."""
    with open(path) as file:
        return [(int(a), int(b) - int(a) - base) for a, b in csv.reader(file)]


def at(series, instant, start):
    """Linear between two lines; and where to go on searching."""
    while start + 1 < len(series) and series[start + 1][0] < instant:
        start += 1
    if start + 1 >= len(series):
        return None, start
    (t0, v0), (t1, v1) = series[start], series[start + 1]
    return v0 + (v1 - v0) * (instant - t0) / (t1 - t0), start


def run(folder, mode, write):
    segments, mains = [], []
    for n, ppm in enumerate(("30,-20,20", "-30,-20,20")):
        port = 35100 + n
        segments.append(subprocess.Popen(
            [FTCS, "ethercat-segment", "--udp", str(port), "--drives", "4", "--ppm", ppm, "--priority", "70", "--clock-csv",
             os.path.join(folder, f"clock{n}.csv"), "--json", os.path.join(folder, f"segment{n}.json")],
            stdout=subprocess.DEVNULL))
    time.sleep(0.5)
    for n in range(2):
        mains.append(subprocess.Popen(
            [FTCS, "ethercat", "run", "--udp", f"127.0.0.1:{35100 + n}", "--drives", "4", "--servo", "adaptive", "-q", "--gate",
             "400us", "--lost-frame-limit", "500", "--drift-pulses", "2000", "--no-motion", "--duration", str(SECONDS),
             "--bus-mode", mode, "--bus-write", write, "--plant-time", "realtime"], stdout=subprocess.DEVNULL))
    codes = [main.wait(timeout=SECONDS + 60) for main in mains]
    for segment in segments:
        segment.terminate()
    for segment in segments:
        segment.wait(timeout=20)
    base = clocks(os.path.join(folder, "clock0.csv"), 0)[-1][1]
    first, second = (clocks(os.path.join(folder, f"clock{n}.csv"), base) for n in range(2))
    begin, end = max(first[0][0], second[0][0]) + SETTLE * 1e9, min(first[-1][0], second[-1][0])
    apart, place = [], 0
    for instant, value in first:
        if begin < instant < end:
            other, place = at(second, instant, place)
            if other is not None:
                apart.append(abs(value - other))
    return sorted(apart), codes


def main():
    failed = []
    print(f"{'mode':10}{'written':14}{'SYNC0 apart p50':>18}{'p99':>12}{'largest':>12}  exit codes")
    for mode, write, judged in WAYS:
        with tempfile.TemporaryDirectory() as folder:
            apart, codes = run(folder, mode, write)
        if not apart:
            failed.append(f"{mode}, {write}: no figures, exit codes {codes}")
            continue
        p50, p99 = apart[len(apart) // 2], apart[int(len(apart) * 0.99)]
        print(f"{mode:10}{write:14}{p50 / 1000:15.3f} us{p99 / 1000:9.3f} us{apart[-1] / 1000:9.3f} us  {codes}", flush=True)
        if judged and (p50 > LIMIT_P50_NS or p99 > LIMIT_P99_NS):
            failed.append(f"{mode}, {write}: p50 {p50:.0f} ns, p99 {p99:.0f} ns")
    for line in failed:
        print("FAILED:", line)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
