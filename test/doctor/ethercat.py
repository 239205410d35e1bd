#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""ethercat.py build/ftcs [NAME]: what can be wrong on an EtherCAT wire, made with drives in software on loopback. The sentence of
`ftcs ethercat run` must name cause and remedy and must not say "locked", and its log, its status, the service manager, the page and
the metrics must all say the same. On a host that has no time for all cases at once frames are lost in each, and that is then what is
said: a case that failed beside the others has another attempt by itself."""
import concurrent.futures
import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

GATE = ["--gate", "2ms"]
PORT = 20000 + os.getpid() % 600 * 20
CYCLE = ["--cycle", "4ms", "--sync-interval", "200ms", "--drift-pulses", "500", "--priority", "0", "--lost-frame-limit",
         "1000"]
# name, the segment's flags (None: there is none), flags of the run, cause, a part of the remedy
CASES = [
    ("nobody on the wire", None, [], "no_subdevice", "does ftcs ethercat-segment run at --udp"),
    ("fewer drives than configured", [], ["--drives", "5"], "too_few_subdevices", "lower --drives"),
    ("no distributed clock", ["--clock-bits", "0"], [], "no_distributed_clock", "--servo none"),
    ("a drive out of reach", ["--fault", "cut:1@4"], ["--ride-through", "60"], "working_counter", "ftcs ethercat scan"),
    ("frames are lost", ["--drop", "0.2"], [], "lost_frames", "a network of its own"),
    ("the host is late", [], ["--gate", "1us"], "host_late", "PREEMPT_RT"),
    ("too small a margin", [], ["--sync0-phase", "0.045"], "margin_too_small", "--sync0-phase nearer to 0.5"),
    ("an axis in Fault", [], [], "axis_fault", "--reset-faults 1"),
]


def without_figures(sentence):
    return re.sub(r"[-+]?\d+(\.\d+)?", "#", sentence)


class Manager:
    """In systemd's place: the last STATUS= that was told."""

    def __init__(self, path):
        self.path = path
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(path)
        self.socket.setblocking(False)
        self.last = ""

    def status(self):
        try:
            while True:
                for line in self.socket.recv(4096).decode().splitlines():
                    if line.startswith("STATUS="):
                        self.last = line[len("STATUS="):]
        except BlockingIOError:
            return self.last


def get(url):
    with urllib.request.urlopen(url, timeout=5) as answer:
        return answer.read().decode()


def say(ftcs, folder, manager, web):
    """What each of them says now."""
    asked = subprocess.run([ftcs, "status", "--json", "-s", f"{folder}/status"], capture_output=True, text=True)
    told = json.loads(asked.stdout)["diagnosis"]
    page = json.loads(get(f"http://127.0.0.1:{web}/state"))
    metrics = re.search(r'^ftcs_diagnosis{.*cause="([a-z_]+)"} 1$', get(f"http://127.0.0.1:{web}/metrics"), re.M)
    causes = [told["cause"], page["cause"], metrics.group(1)]
    return causes, [told["sentence"], page["sentence"], manager.status()]


def agree(ftcs, folder, manager, web, cause):
    """Waits until status, page, service manager and metrics have said the same of that cause; what is wrong, or nothing."""
    seen = "nothing"
    end = time.monotonic() + 25
    while time.monotonic() < end:
        time.sleep(0.5)
        try:
            causes, sentences = say(ftcs, folder, manager, web)
        except (OSError, ValueError, AttributeError, KeyError) as error:
            seen = repr(error)
            continue
        if set(causes) == {cause} and len(set(map(without_figures, sentences))) == 1:
            return None
        seen = f"{causes}, {sentences}"
    return f"no agreement on {cause}: {seen}"


def examine(ftcs, number, case):
    name, segment, flags, cause, remedy = case
    port, web = PORT + 2 * number, PORT + 2 * number + 1
    wrong = []
    at_fault = {"no_subdevice": 1, "too_few_subdevices": 1, "no_distributed_clock": 1}
    with tempfile.TemporaryDirectory() as folder:
        manager = Manager(f"{folder}/manager")
        processes = []
        if segment is not None:
            processes.append(subprocess.Popen([ftcs, "ethercat-segment", "--udp", str(port), "--drives", "2", "--priority", "0", *segment],
                                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
            time.sleep(0.5)
        with open(f"{folder}/log", "w+") as log:
            run = subprocess.Popen([ftcs, "ethercat", "run", "--udp", f"127.0.0.1:{port}", *CYCLE, "--duration", "0", "-q", "--uds_address",
                                    f"{folder}/status", "--web", str(web), *([] if "--gate" in flags else GATE), *flags], stdout=log, stderr=log,
                                   env={**os.environ, "NOTIFY_SOCKET": manager.path})
            if cause == "axis_fault":  # the drives miss SYNC0 for a second; the cycle comes back, the axes do not
                time.sleep(4)
                run.send_signal(signal.SIGSTOP)
                time.sleep(1)
                run.send_signal(signal.SIGCONT)
            if at_fault.get(cause) != 1:  # those end at once
                disagreement = agree(ftcs, folder, manager, web, cause)
                if disagreement:
                    wrong.append(disagreement)
            else:
                run.wait(30)
            run.send_signal(signal.SIGINT)
            code = run.wait(30)
            for process in processes:
                process.terminate()
                process.wait()
            log.seek(0)
            said = log.read()
    sentence = next((line for line in said.splitlines() if remedy in line), "")
    if not re.match("ftcs ethercat: (not locked: |in phase, but )", sentence):
        wrong.append(f"the log has no sentence with '{remedy}'")
    if code != at_fault.get(cause, 3):
        wrong.append(f"exit code {code}")
    return wrong + ([said] if wrong else []), sentence


def main():
    ftcs = os.path.realpath(sys.argv[1])
    cases = [case for case in CASES if len(sys.argv) < 3 or sys.argv[2] in case[0]]
    failures = 0
    with concurrent.futures.ThreadPoolExecutor(len(CASES)) as pool:
        answers = list(pool.map(lambda numbered: examine(ftcs, *numbered), enumerate(cases)))
    for number, (case, (wrong, sentence)) in enumerate(zip(cases, answers)):
        if wrong:
            print(f"again  {case[0]}: {'; '.join(wrong[:-1])[:200]}", flush=True)
            wrong, sentence = examine(ftcs, number, case)
        print(f"{'FAILED' if wrong else 'ok':6} {case[0]:30} {case[3]:22} {sentence}", flush=True)
        for line in wrong:
            print("       ", line)
        failures += bool(wrong)
    print(f"{len(cases)} cases, {failures} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
