#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Two machines, one time, live. Two segments of four modelled drives and two MainDevices, each in a network namespace of its
own on raw Ethernet (veth), cycle 1 ms, reference clocks 60 ppm apart, software stamps. How far SYNC0 of the two segments
stand apart, by the clock of the host that both share, for increments of 0x0920 on plant time from CLOCK_REALTIME (external
and lead), from a PTP grandmaster in a fifth namespace (--plant-time ptp) and from the time stamps of a bridge terminal in
each segment, whose other side shows CLOCK_REALTIME, and, as the baseline, for plain writes of 0x0910 as others do them. Arguments: program, seconds that are judged of each way (default 60), the ways (default all).
Skipped (77) without root, or when the host stood still too often to judge."""
import csv
import json
import os
import subprocess
import sys
import tempfile
import time

FTCS = os.path.realpath(sys.argv[1] if len(sys.argv) > 1 else "build/ftcs")
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
SETTLE_S = 15.0
LIMITS_NS = 2_000, 10_000  # p50, p99
PTP_LIMITS_NS = 5_000, 20_000  # the software stamps of two PTP receivers are in it
LARGEST_EXCLUDED = 0.02
PTP = "ptp:{}"
BRIDGE = "bridge"
WAYS = {  # name: mode, what is written, plant time, limits; none: the baseline
    "external": ("external", "offset", "realtime", LIMITS_NS),
    "lead": ("lead", "offset", "realtime", LIMITS_NS),
    "external-ptp": ("external", "offset", PTP, PTP_LIMITS_NS),
    "external-bridge": ("external", "offset", BRIDGE, LIMITS_NS),
    "target-time": ("external", "target-time", "realtime", None),
    "read-time": ("external", "read-time", "realtime", None),
}
NAME = f"ftcs{os.getpid()}"


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def sh(*command):
    return subprocess.run(command, stderr=subprocess.DEVNULL, check=False).returncode == 0


class Plant:
    """Namespaces: main and segment of each machine, and the grandmaster, a bridge to both mains."""

    def __enter__(self):
        self.spaces = [f"{NAME}{x}" for x in ("m0", "s0", "m1", "s1", "gm")]
        for space in self.spaces:
            if not sh("ip", "netns", "add", space):
                skip("no network namespaces")
            sh("ip", "netns", "exec", space, "sysctl", "-qw", "net.ipv6.conf.all.disable_ipv6=1")
        sh("ip", "-n", f"{NAME}gm", "link", "add", "br0", "type", "bridge")
        for n in range(2):
            main, segment = f"{NAME}m{n}", f"{NAME}s{n}"
            if not sh("ip", "link", "add", "ec", "netns", main, "type", "veth", "peer", "name", "ec", "netns", segment):
                skip("no veth")
            sh("ip", "link", "add", "ptp", "netns", main, "type", "veth", "peer", "name", f"p{n}", "netns", f"{NAME}gm")
            sh("ip", "-n", f"{NAME}gm", "link", "set", f"p{n}", "master", "br0", "up")
            sh("ip", "-n", main, "addr", "add", f"10.99.0.{n + 1}/24", "dev", "ptp")
            for space, device in ((main, "ec"), (main, "ptp"), (segment, "ec")):
                sh("ip", "-n", space, "link", "set", device, "up")
        sh("ip", "-n", f"{NAME}gm", "addr", "add", "10.99.0.9/24", "dev", "br0")
        sh("ip", "-n", f"{NAME}gm", "link", "set", "br0", "up")
        return self

    def __exit__(self, *_):
        for space in self.spaces:
            sh("ip", "netns", "del", space)


def start(space, *arguments):
    return subprocess.Popen(["ip", "netns", "exec", NAME + space, FTCS, *arguments], stdout=subprocess.DEVNULL)


def end(processes):
    for process in processes:
        process.terminate()
    for process in processes:
        process.wait(timeout=20)


def clocks(path, base):
    """Monotonic time and system time less it, ns; whole numbers, less a base: a float does not hold them."""
    with open(path) as file:
        return [(int(row[0]), int(row[1]) - int(row[0]) - base) for row in csv.reader(file) if len(row) == 2]


def at(series, instant, begin):
    """Linear between two lines; and where to go on searching."""
    while begin + 1 < len(series) and series[begin + 1][0] < instant:
        begin += 1
    if begin + 1 >= len(series):
        return None, begin
    (t0, v0), (t1, v1) = series[begin], series[begin + 1]
    return v0 + (v1 - v0) * (instant - t0) / (t1 - t0), begin


def apart(folder):
    """|difference| of the two reference clocks at the lines of the first, in the last SECONDS."""
    base = clocks(os.path.join(folder, "clock0.csv"), 0)[-1][1]
    first, second = (clocks(os.path.join(folder, f"clock{n}.csv"), base) for n in range(2))
    last = min(first[-1][0], second[-1][0])
    values, place = [], 0
    for instant, value in first:
        if last - SECONDS * 1e9 < instant < last:
            other, place = at(second, instant, place)
            if other is not None:
                values.append(abs(value - other))
    return sorted(values)


def run(folder, mode, write, plant_time):
    beside, mains = [], []
    if plant_time == PTP:
        beside.append(start("gm", "ptp", "--role", "time-transmitter", "-i", "br0", "--logSyncInterval", "-3"))
    drives = ["--drives", "5", "--bridge", "4"] if plant_time == BRIDGE else ["--drives", "4"]
    for n, ppm in enumerate(("30,-20,20", "-30,-20,20")):
        beside.append(start(f"s{n}", "ethercat-segment", "-i", "ec", *drives, "--ppm", ppm, "--priority", "70",
                            "--clock-csv", os.path.join(folder, f"clock{n}.csv")))
    time.sleep(3.0)  # a busy host starts programs late
    for n in range(2):
        mains.append(start(f"m{n}", "ethercat", "run", "-i", "ec", "--drives", "4", "--servo", "adaptive", "-q", "--gate",
                           "400us", "--lost-frame-limit", "500", "--drift-pulses", "2000", "--no-motion", "--duration",
                           str(SETTLE_S + SECONDS), "--bus-mode", mode, "--bus-write", write, "--plant-time",
                           plant_time.format("ptp"), "--json", os.path.join(folder, f"main{n}.json")))
    codes = [main.wait(timeout=SETTLE_S + SECONDS + 90) for main in mains]
    end(beside)
    excluded = [json.load(open(os.path.join(folder, f"main{n}.json")))["excluded_share"] for n in range(2)]
    return codes, max(excluded)


def judge(name, values, codes, excluded):
    """What is wrong, and whether the host was too busy to say."""
    p50, p99 = values[len(values) // 2], values[int(len(values) * 0.99)]
    limits = WAYS[name][3]
    print(f"{name:14}{p50 / 1000:12.3f} us{p99 / 1000:10.3f} us{values[-1] / 1000:10.3f} us{100 * excluded:9.2f} %  {codes}"
          f"{'' if limits else '  (baseline)'}", flush=True)
    bad = limits is not None and (p50 > limits[0] or p99 > limits[1])
    return f"{name}: p50 {p50:.0f} ns, p99 {p99:.0f} ns" if bad else None, excluded > LARGEST_EXCLUDED


def main():
    if os.geteuid() != 0:
        skip("needs root for network namespaces")
    failed, busy = [], False
    print(f"{'':14}{'SYNC0 apart p50':>15}{'p99':>13}{'largest':>13}{'late cycles':>12}  exit codes")
    with Plant():
        for name in sys.argv[3:] or WAYS:
            with tempfile.TemporaryDirectory() as folder:
                try:
                    codes, excluded = run(folder, *WAYS[name][:3])
                except FileNotFoundError as missing:
                    failed.append(f"{name}: a MainDevice ended without its figures ({missing.filename})")
                    continue
                values = apart(folder)
            if len(values) < SECONDS:
                failed.append(f"{name}: no figures, exit codes {codes}")
                continue
            wrong, late = judge(name, values, codes, excluded)
            busy = busy or (late and wrong is not None)
            if wrong and not late:
                failed.append(wrong)
    if failed:
        sys.exit("FAILED: " + "; ".join(failed))
    if busy:
        skip("more than 2 % of the cycles were late or slow, the host is too busy to judge")


if __name__ == "__main__":
    main()
