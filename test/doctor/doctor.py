#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""doctor.py build/ftcs [NAME]: each misconfiguration of cases.py for real, over a veth pair in two network namespaces of its own;
`ftcs doctor` must name the cause and the remedy, and must not say "locked". Several at a time. Needs root; exit code 77 without."""
import concurrent.futures
import os
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from cases import CASES, GOOD  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
LISTEN_S = 5
AGAIN = 100
AFTER_A_LOCK = ("locked", "first_offset", "transmitters_disagree")
PTP4L = ["[global]", "free_running 1", "time_stamping software", "twoStepFlag 1", "tx_timestamp_timeout 50", "logAnnounceInterval -1",
         "logSyncInterval -2", "logMinDelayReqInterval -2", "fault_reset_interval -2"]


def call(*command, **more):
    return subprocess.run(command, check=True, capture_output=True, text=True, **more)


class Network:
    """Two namespaces and a veth pair between them; gone at the end."""

    def __init__(self, number):
        mark = f"{os.getpid() % 100000}x{number}"
        self.ours, self.theirs = f"ftcs-da{mark}", f"ftcs-db{mark}"
        self.interface, self.peer = f"da{mark}", f"db{mark}"
        self.processes = []
        self.folder = tempfile.mkdtemp()

    def __enter__(self):
        for name in (self.ours, self.theirs):
            call("ip", "netns", "add", name)
        call("ip", "link", "add", self.interface, "netns", self.ours, "type", "veth", "peer", "name", self.peer, "netns", self.theirs)
        for name, device, address in ((self.ours, self.interface, "10.77.0.1/24"), (self.theirs, self.peer, "10.77.0.2/24")):
            subprocess.run(["ip", "netns", "exec", name, "sysctl", "-qw", f"net.ipv6.conf.{device}.accept_dad=0"], capture_output=True)
            call("ip", "-n", name, "address", "add", address, "dev", device)
            call("ip", "-n", name, "link", "set", "lo", "up")
            call("ip", "-n", name, "link", "set", device, "up")
        return self

    def __exit__(self, *ignored):
        for process in self.processes:
            process.terminate()
            process.wait()
        for name in (self.ours, self.theirs):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True)
        shutil.rmtree(self.folder)

    def start(self, namespace, *command):
        log = open(os.path.join(self.folder, f"log{len(self.processes)}"), "w")
        self.processes.append(subprocess.Popen(["ip", "netns", "exec", namespace, *command], stdout=log, stderr=log))

    def transmit(self, case):
        for number, faults in enumerate(faults for faults in (case["faults"], case.get("second")) if faults is not None):
            if case["by"] == "raw":
                self.start(self.theirs, sys.executable, os.path.join(HERE, "transmitter.py"), self.peer, *faults)
            elif case["by"] == "ptp4l":
                config = os.path.join(self.folder, f"ptp4l{number}.conf")
                with open(config, "w") as file:
                    file.write("\n".join(PTP4L + [f"uds_address {self.folder}/uds{number}"] + faults) + "\n")
                self.start(self.theirs, "ptp4l", "-f", config, "-i", self.peer, "-m", "-q")
        if case["by"] == "ptp4l":
            time.sleep(2.5)  # LISTENING until its Announce timeout


def examine(ftcs, number, case, listen_s):
    """What is wrong with the answer, or nothing; and its first line."""
    with Network(number) as network:
        if "prepare" in case:
            command = case["prepare"].replace("$INTERFACE", network.interface).replace("$PEER", network.peer)
            command = command.replace("$THEIRS", network.theirs)
            call("ip", "netns", "exec", network.ours, "sh", "-c", command)
        network.transmit(case)
        usual = {"-i": network.interface, "--duration": str(listen_s), "--logAnnounceInterval": "-1", "--logMinDelayReqInterval": "-2"}
        flags = [word for name, value in usual.items() if name not in case["flags"] for word in (name, value)]
        done = subprocess.run(["ip", "netns", "exec", network.ours, ftcs, "doctor", *flags, *case["flags"]],
                              capture_output=True, text=True, timeout=60)
    lines = done.stdout.splitlines()
    listened = bool(lines) and lines[0].startswith("listening on ")
    sentence = next((line for line in lines if not line.startswith("listening on ")), "")
    causes = [line.split()[1] for line in lines if line.startswith("  cause")]
    wrong = []
    if causes[:1] != [case["cause"]]:
        wrong.append(f"cause {causes[:1]}, expected {case['cause']}")
    if case["remedy"].lower() not in done.stdout.lower():
        wrong.append(f"no word of '{case['remedy']}'")
    good = case["cause"] == "locked"
    if sentence.startswith("locked") != good or (not good and not sentence.startswith(("not locked: ", "in doubt: "))):
        wrong.append("locked or not?")
    if listened != case.get("listens", True):
        wrong.append("says that it listens, and knows the cause before" if listened else "does not listen")
    if done.returncode != (0 if good else 3):
        wrong.append(f"exit code {done.returncode}")
    if wrong:
        wrong.append(done.stdout + done.stderr)
    return wrong, sentence


def examine_patiently(ftcs, number, case):
    """What only a locked clock can tell is asked again, for longer: a busy host may not be locked within that time."""
    wrong, sentence = examine(ftcs, number, case, LISTEN_S)
    again = wrong and case["cause"] in AFTER_A_LOCK
    return examine(ftcs, number + AGAIN, case, 4 * LISTEN_S) if again else (wrong, sentence)


def main():
    if os.geteuid() != 0 or not all(map(shutil.which, ("ip", "ptp4l"))):
        print("skipped: needs root, ip and ptp4l")
        return 77
    if subprocess.run(["unshare", "-n", "ip", "link", "add", "va0", "type", "veth", "peer", "name", "vb0"], capture_output=True).returncode:
        print("skipped: may not make network namespaces")
        return 77
    ftcs = os.path.realpath(sys.argv[1])
    cases = [case for case in CASES + GOOD if len(sys.argv) < 3 or sys.argv[2] in case["name"]]
    failures = 0
    with concurrent.futures.ThreadPoolExecutor(9) as pool:
        answers = pool.map(lambda numbered: examine_patiently(ftcs, *numbered), enumerate(cases))
        for case, (wrong, sentence) in zip(cases, answers):
            print(f"{'FAILED' if wrong else 'ok':6} {case['name']:34} {case['cause']:22} {sentence}", flush=True)
            for line in wrong:
                print("       ", line)
            failures += bool(wrong)
    print(f"{len(cases)} cases, {failures} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
