#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""everywhere.py build/ftcs: an ftcs ptp that cannot lock says the same sentence in its log, in ftcs status, to the service manager and on the
page, and the same cause in its metrics. On loopback, with ports of its own."""
import concurrent.futures
import os
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from ethercat import Manager, agree, without_figures  # noqa: E402

PORT = 20000 + os.getpid() % 800 * 15
# flags of a transmitter on the same ports (None: there is none), flags of the receiver, cause
CASES = [
    (None, [], "no_announce"),
    (["--domainNumber", "5"], [], "domain"),
    (["--transportSpecific", "3"], [], "sdo"),
    ([], ["--acceptable-transmitter", "001122.fffe.334455"], "not_acceptable"),
    ([], ["-P"], "no_peer"),
]


def examine(ftcs, number, case):
    transmitter, flags, cause = case
    event, general, web = (PORT + 3 * number + i for i in range(3))
    base = [ftcs, "ptp", "-i", "lo", "-S", "--event-port", str(event), "--general-port", str(general), "--logAnnounceInterval", "-2"]
    with tempfile.TemporaryDirectory() as folder, open(f"{folder}/log", "w+") as log:
        manager = Manager(f"{folder}/manager")
        processes = []
        if transmitter is not None:
            processes.append(subprocess.Popen([*base, "--role", "time-transmitter", "--uds_address", "none", "--logSyncInterval", "-3",
                                               *transmitter], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        processes.append(subprocess.Popen([*base, "--uds_address", f"{folder}/status", "--web", str(web), *flags], stdout=log, stderr=log,
                                          env={**os.environ, "NOTIFY_SOCKET": manager.path}))
        wrong = agree(ftcs, folder, manager, web, cause)
        sentence = manager.status()
        ended = processes[-1].poll()
        for process in reversed(processes):
            process.send_signal(signal.SIGINT)
            process.wait()
        log.seek(0)
        said = log.read()
    if ended is not None:
        wrong = f"ended with {ended}: {said}"
    elif wrong:
        wrong += f"; its log: {said}"
    elif without_figures(sentence) not in without_figures(said):
        wrong = f"the log has no word of it: {said}"
    return wrong, cause, sentence


def main():
    ftcs = os.path.realpath(sys.argv[1])
    failures = 0
    with concurrent.futures.ThreadPoolExecutor(len(CASES)) as pool:
        for wrong, cause, sentence in pool.map(lambda numbered: examine(ftcs, *numbered), enumerate(CASES)):
            print(f"{'FAILED' if wrong else 'ok':6} {cause:16} {wrong or sentence}", flush=True)
            failures += bool(wrong)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
