#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The table of servos on true error, with unmodified programs inside clknetsim (https://github.com/mlichvar/clknetsim):
ftcs ptp, ptp4l (pi, linreg) and chronyd steer the clock of one simulated node, whose hardware clock and system clock
are the same clock; another node's perfect clock is the reference (ptp4l as PTP time transmitter, chronyd as NTP server).
With `--suite phc`: ftcs phc beside phc2sys, the source being a hardware clock read with noise.

  CLKNETSIM_PATH=folder test/peer/clknetsim_table.py --ftcs build/ftcs --seeds 20 --peer-seeds 5

Each run has 1,200 cycles; rms and max are of the true error (8 readings a cycle) over the last 600. bound: rms of a Kalman
filter that knows the noise, on the same packets (gaussian noise alone): what no servo beats but by chance. c5: cycles from
the first Sync after the transmitter was selected (NTP: the first answer) until the true error stays within 5 x noise for 60
cycles. Every program is started without the right to set clocks (CAP_SYS_TIME dropped): a mistake cannot steer this machine.
"""
import argparse
import json
import math
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from clknetsim_scenarios import LINK, PHC_SCENARIOS, SCENARIOS  # noqa: E402

MEASURED = 600


def write(path, text):
    with open(path, "w") as file:
        file.write(text)
    return path


def ptp4l_config(scenario, folder, name, settings):
    log = round(math.log2(scenario.interval))
    lines = {"logSyncInterval": log, "logMinDelayReqInterval": log, "summary_interval": 30, **settings}
    return write(os.path.join(folder, name), "[global]\n" + "".join(f"{k} {v}\n" for k, v in lines.items()))


def ptp_transmitter(scenario, folder, tools, settings):
    config = ptp4l_config(scenario, folder, "transmitter.conf", {"free_running": 1, **settings})
    return [tools["ptp4l"], "-f", config, "-i", "eth0", "-m", "-q"]


def mechanism(scenario, p2p):
    return {"delay_mechanism": "P2P", "logMinPdelayReqInterval": round(math.log2(scenario.interval))} if p2p else {}


# clknetsim's clocks begin in 1970, it says of every message that it was sent to one host, and it does not simulate
# CLOCK_BOOTTIME, by which ftcs watches whether a reference jumps. It knows no filter of system calls.
IN_CLKNETSIM = ["--unconfined", "--allow-epoch", "--max-change", "0", "--max-total-change", "0"]


def ftcs(servo, *more, p2p=False):
    def commands(scenario, folder, tools):
        node = [tools["ftcs"], "ptp", "-i", "eth0", "-P" if p2p else "-E", "--servo", servo,
                "--unicast", "192.168.123.1", *IN_CLKNETSIM, *(more or ("-H", "--clock", "phc")), *(["--first-step"] if scenario.step else []),
                *(f"--{key}={value}" for key, value in mechanism(scenario, p2p).items())]
        return [ptp_transmitter(scenario, folder, tools, mechanism(scenario, p2p)), node]
    return commands


def ptp4l(servo, p2p=False):
    def commands(scenario, folder, tools):
        config = ptp4l_config(scenario, folder, "receiver.conf", {
            "slaveOnly": 1, "clock_servo": servo, "first_step_threshold": "0.00002" if scenario.step else "0.0",
            **mechanism(scenario, p2p)})
        node = [tools["ptp4l"], "-f", config, "-i", "eth0", "-m", "-q"]
        return [ptp_transmitter(scenario, folder, tools, mechanism(scenario, p2p)), node]
    return commands


def chronyd(scenario, folder, tools):
    poll = round(math.log2(scenario.interval))
    server = write(os.path.join(folder, "server.conf"),
                   f"local stratum 1\nallow\npidfile {folder}/pid1\ncmdport 0\nbindcmdaddress /\n")
    step = "makestep 2e-5 1\n" if scenario.step else ""
    client = write(os.path.join(folder, "client.conf"),
                   f"server 192.168.123.1 minpoll {poll} maxpoll {poll} xleave\n{step}maxslewrate 30000\n"
                   f"pidfile {folder}/pid2\ncmdport 0\nbindcmdaddress /\n")
    return [[tools["chronyd"], "-d", "-u", "root", "-f", server], [tools["chronyd"], "-d", "-u", "root", "-f", client]]


def ftcs_phc(*more):
    def commands(scenario, _folder, tools):
        return [[tools["ftcs"], "phc", *IN_CLKNETSIM, "-s", "/dev/ptp0", "-O", "0", "-R", str(1 / scenario.interval),
                 "-F", "0.00002" if scenario.step else "0", *more]]
    return commands


def phc2sys(servo):
    def commands(scenario, _folder, tools):
        return [[tools["phc2sys"], "-s", "/dev/ptp0", "-c", "CLOCK_REALTIME", "-O", "0", "-m", "-q", "-E", servo,
                 "-R", str(1 / scenario.interval), "-F", "0.00002" if scenario.step else "0"]]
    return commands


CANDIDATES = {
    "ftcs": ftcs("adaptive"),
    "ftcs system clock": ftcs("adaptive", "-S", "--clock", "system", "--utc_offset", "0"),
    "ftcs p2p": ftcs("adaptive", p2p=True),
    "ftcs ptp pi": ftcs("linuxptp-pi"),
    "ptp4l pi": ptp4l("pi"),
    "ptp4l linreg": ptp4l("linreg"),
    "chronyd": chronyd,
    "ptp4l pi p2p": ptp4l("pi", p2p=True),
    "ptp4l linreg p2p": ptp4l("linreg", p2p=True),
}
PHC_CANDIDATES = {"ftcs phc": ftcs_phc(), "ftcs phc pi": ftcs_phc("-E", "pi"), "phc2sys pi": phc2sys("pi"),
                  "phc2sys linreg": phc2sys("linreg")}

GUARD = ["setpriv", "--bounding-set", "-sys_time", "--inh-caps", "-sys_time"]


def simulate(scenario, commands, seed, folder, path):
    """Returns (offset of the steered clock against the reference in ns, time of the first message that counts)."""
    socket, offsets, packets = (os.path.join(folder, name) for name in ("socket", "offsets", "packets"))
    steered = len(commands)  # the last node
    text = scenario.network(folder, seed)
    if steered == 1:
        noise = scenario.forward
        text = f"node1_offset = 0.001\nnode1_freq = {scenario.frequency(scenario.rate)}\nnode1_refclock = (+ 0 {noise})\n"
    config = write(os.path.join(folder, "network"), text)
    nodes, logs = [], []
    for number, command in enumerate(commands, 1):
        logs.append(os.path.join(folder, f"log{number}"))
        preload = [f"LD_PRELOAD={path}/clknetsim.so", f"CLKNETSIM_NODE={number}", f"CLKNETSIM_SOCKET={socket}",
                   f"CLKNETSIM_RANDOM_SEED={1000 * number + seed}"]
        with open(logs[-1], "w") as log:
            nodes.append(subprocess.Popen(GUARD + ["env"] + preload + command, stdout=log, stderr=subprocess.STDOUT))
    server = subprocess.run([f"{path}/clknetsim", "-s", socket, "-R", str(scenario.rate), "-o", offsets, "-p", packets,
                             "-l", str(scenario.length), config, str(steered)], capture_output=True, text=True,
                            env={**os.environ, "CLKNETSIM_RANDOM_SEED": str(seed)}, check=False)
    for node in nodes:
        node.wait()
    if server.returncode != 0:
        raise RuntimeError(server.stderr + open(logs[-1]).read()[-2000:])
    errors = []
    with open(offsets) as file:
        for line in file:
            values = [float(value) for value in line.split()]
            errors.append((values[-1] - (values[0] if steered > 1 else 0.0)) * 1e9)
    return errors, first_message(logs[-1], packets) if steered > 1 else 0.0


def first_message(log, packets):
    """The first Sync after the port has a transmitter; without PTP the first packet to the steered node."""
    since = 0.0
    for line in open(log):
        found = re.match(r"\S+\[(\d+\.\d+)\]: port 1.*: LISTENING to UNCALIBRATED", line)
        if found:
            since = float(found[1]) - 0.01
            break
    for line in open(packets):
        fields = line.split()
        is_ntp = since == 0.0
        if fields[1] == "1" and fields[2] == "2" and (is_ntp or (fields[5] == "319" and float(fields[0]) >= since)):
            return float(fields[0])
    return math.nan


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


def judge(scenario, errors, first):
    per_cycle, rate, figures = 8, scenario.rate, {}
    tail = errors[-MEASURED * per_cycle:]
    figures["rms"], figures["max"] = rms(tail), max(map(abs, tail))
    if scenario.event == "outage":
        figures["rms"] = rms(errors[round(669.5 * rate):round(671 * rate)])
        figures["max"] = max(map(abs, errors[round(669.5 * rate):round(671 * rate)]))
    if scenario.event == "reference":
        at = round(scenario.event_time * rate)
        figures["after 3"] = max(map(abs, errors[at + 3 * per_cycle:at + 100 * per_cycle]))
        figures["overshoot"] = max(0.0, max(errors[at:at + 100 * per_cycle]))  # we start 20 us behind
    band, dwell, run = scenario.c5_band * 1e9, 60 * per_cycle, 0
    figures["c5"] = math.inf
    for i, error in enumerate(errors):
        run = run + 1 if abs(error) < band else 0
        if run == dwell:
            # Reading i was taken (i + 1) / rate s after the start (the first one is the start itself).
            figures["c5"] = max(0.0, ((i - dwell + 1) / rate - first) / scenario.interval)
            break
    return figures


def bound(scenario, packets, first):
    """rms in ns, over the measured cycles, of a Kalman filter of offset, rate and path delay that knows the noise."""
    sigma, walk = scenario.known
    messages = []
    for line in open(packets):
        fields = line.split()
        if fields[5] == "319" and float(fields[0]) >= first - 1e-3:
            delay, forward = float(fields[3]), fields[1] == "1"
            taken = float(fields[0]) + (delay if forward else 0.0)  # when the steered node took its stamp
            messages.append((taken, 1.0 if forward else -1.0, (delay - float(LINK)) * 1e9))
    # Errors of the estimates, whose true values do not matter to a linear filter.
    x, y, d = 1e6, 5e4, 1e4
    pxx, pxy, pxd, pyy, pyd, pdd = 1e12, 0.0, 0.0, 1e10, 0.0, 1e8
    readings = [(i + 1) / scenario.rate for i in range(round(scenario.length * scenario.rate))]
    errors, i, now = [], 0, first
    # What the walk did is not known here: with one it is the filter's own variance.
    for taken, sign, noise in sorted(messages) + [(scenario.length + 1.0, 0.0, 0.0)]:
        while i < len(readings) and readings[i] < taken:
            dt = readings[i] - now
            own = pxx + dt * (2 * pxy + dt * pyy) + walk ** 2 * dt ** 3 / 3
            errors.append((x + y * dt) ** 2 if walk == 0.0 else own)
            i += 1
        if sign == 0.0:
            break
        dt, now = taken - now, taken
        x += y * dt
        pxx += dt * (2 * pxy + dt * pyy) + walk ** 2 * dt ** 3 / 3
        pxy, pxd, pyy = pxy + dt * pyy + walk ** 2 * dt ** 2 / 2, pxd + dt * pyd, pyy + walk ** 2 * dt
        hx, hy, hd = pxx + sign * pxd, pxy + sign * pyd, pxd + sign * pdd
        variance = hx + sign * hd + sigma ** 2
        innovation = sign * noise - (x + sign * d)
        kx, ky, kd = hx / variance, hy / variance, hd / variance
        x, y, d = x + kx * innovation, y + ky * innovation, d + kd * innovation
        pxx, pxy, pxd = pxx - kx * hx, pxy - kx * hy, pxd - kx * hd
        pyy, pyd, pdd = pyy - ky * hy, pyd - ky * hd, pdd - kd * hd
    tail = errors[-MEASURED * 8:]
    return math.sqrt(sum(tail) / len(tail))


def number(value):
    if math.isinf(value):
        return "never"
    return f"{value:.2f}" if abs(value) < 10 else f"{value:.0f}" if abs(value) >= 100 else f"{value:.1f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ftcs", default="build/ftcs")
    parser.add_argument("--suite", choices=["ptp", "phc"], default="ptp")
    parser.add_argument("--seeds", type=int, default=20, help="of ftcs")
    parser.add_argument("--peer-seeds", type=int, default=5)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--scenario", action="append", help="part of a name; default all")
    parser.add_argument("--candidate", action="append", help="a name; default ftcs and the peers that are there")
    parser.add_argument("--chronyd", default=shutil.which("chronyd") or "/usr/sbin/chronyd")
    parser.add_argument("--results", help="write every figure as JSON lines")
    parser.add_argument("--check", action="store_true", help="exit code 1 if ftcs misses a median")
    arguments = parser.parse_args()

    path = os.environ.get("CLKNETSIM_PATH", "")
    if not os.access(os.path.join(path, "clknetsim"), os.X_OK):
        print("skipped: CLKNETSIM_PATH names no folder with clknetsim")
        return 77
    if not shutil.which("setpriv"):
        print("skipped: no setpriv to drop the right to set clocks")
        return 77
    tools = {name: shutil.which(name) or f"/usr/sbin/{name}" for name in ("ptp4l", "phc2sys")}
    tools.update(ftcs=os.path.realpath(arguments.ftcs), chronyd=arguments.chronyd)
    if not os.access(tools["ptp4l"], os.X_OK):
        print("skipped: no ptp4l")
        return 77
    candidates = CANDIDATES if arguments.suite == "ptp" else PHC_CANDIDATES
    scenarios = SCENARIOS if arguments.suite == "ptp" else PHC_SCENARIOS
    default = [name for name in candidates if name in ("ftcs", "ftcs phc") or re.fullmatch(r"\w+ (pi|linreg)", name)
               or (name == "chronyd" and os.access(tools["chronyd"], os.X_OK))]
    missed = []
    print(f"{'scenario':24} {'program':18} {'seeds':>5}  c5 median / worst   rms median / worst   max median / worst")
    for scenario in scenarios:
        if arguments.scenario and not any(part in scenario.name for part in arguments.scenario):
            continue
        for name in arguments.candidate or default:
            seeds = arguments.seeds if name.startswith("ftcs") else arguments.peer_seeds
            runs = []
            for seed in range(arguments.first_seed, arguments.first_seed + seeds):
                with tempfile.TemporaryDirectory() as folder:
                    errors, first = simulate(scenario, candidates[name](scenario, folder, tools), seed, folder, path)
                    runs.append(judge(scenario, errors, first))
                    if name == "ftcs" and scenario.known:
                        runs[-1]["bound"] = bound(scenario, os.path.join(folder, "packets"), first)
                if arguments.results:
                    with open(arguments.results, "a") as file:
                        file.write(json.dumps({"scenario": scenario.name, "program": name, "seed": seed,
                                               **runs[-1]}) + "\n")
            def both(figure, runs=runs):
                values = [run[figure] for run in runs]
                return statistics.median(values), max(values)
            columns = [f"{number(m):>8} / {number(w):<8}" for m, w in (both("c5"), both("rms"), both("max"))]
            extra = "".join(f"  {figure} {number(both(figure)[0])} / {number(both(figure)[1])}"
                            for figure in ("after 3", "overshoot", "bound") if figure in runs[0])
            verdict = ""
            if name in ("ftcs", "ftcs p2p") and scenario.goal:
                wrong = []
                for figure, (median, worst) in scenario.goal.items():
                    if both(figure)[0] > median:
                        wrong.append(f"{figure} median {number(both(figure)[0])} > {median}")
                        missed.append(f"{scenario.name}: {wrong[-1]}")
                    if worst is not None and both(figure)[1] > worst:
                        wrong.append(f"{figure} worst {number(both(figure)[1])} > {worst}")
                verdict = "  goals met" if not wrong else "  MISSED: " + ", ".join(wrong)
            print(f"{scenario.name:24} {name:18} {seeds:5}  {'  '.join(columns)}{extra}{verdict}", flush=True)
    for line in missed:
        print("missed:", line)
    return 1 if missed and arguments.check else 0


if __name__ == "__main__":
    sys.exit(main())
