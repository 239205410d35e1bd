#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""clients.py build/ftcs: forty web clients, twice as many as have a place, that are slow or silent, come at once to the page's address
(IPv6). While they do the clock stays locked, the metrics at an address of their own are not kept waiting, threads and memory stay; and
the page answers again when they have gone. Exit code 77 where there is no IPv6."""
import concurrent.futures
import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

PORT = 20000 + os.getpid() % 3000 * 4
CLIENTS = 40  # 8 are answered at the same time, 8 wait, 6 are the kernel's


def get(url, timeout):
    begin = time.monotonic()
    with urllib.request.urlopen(url, timeout=timeout) as answer:
        return answer.read().decode(), time.monotonic() - begin


def status(pid, name):
    with open(f"/proc/{pid}/status") as file:
        return int(re.search(rf"^{name}:\s+(\d+)", file.read(), re.M).group(1))


def state(ftcs, folder):
    asked = subprocess.run([ftcs, "status", "--json", "-s", f"{folder}/uds"], capture_output=True, text=True)
    return json.loads(asked.stdout or "{}")


def until_locked(ftcs, folder, receiver):
    for _ in range(100):
        assert receiver.poll() is None, f"the receiver ended with exit code {receiver.returncode}"
        if state(ftcs, folder).get("locked"):
            return
        time.sleep(0.3)
    raise AssertionError("never locked")


def client(number):
    """Half of a request and silence; an event stream that nobody reads; nothing at all. Whom the server has no place for the kernel
    lets in when it asks again, after a second or several."""
    connection = socket.create_connection(("::1", PORT + 2), timeout=60)
    connection.sendall((b"GET /sta", b"GET /events HTTP/1.1\r\nHost: [::1]\r\n\r\n", b"")[number % 3])
    return connection


def has_ipv6():
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            return True
    except OSError:
        return False


def examine(ftcs, folder, receiver):
    until_locked(ftcs, folder, receiver)
    page, metrics = f"http://[::1]:{PORT + 2}/", f"http://127.0.0.1:{PORT + 3}/metrics"
    get(page, 5)
    threads, memory = status(receiver.pid, "Threads"), status(receiver.pid, "VmRSS")
    slowest, more, grown, used, began = 0.0, 0, 0, [], time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(CLIENTS) as pool:  # who waits for the door does not keep the next one from it
        coming = [pool.submit(client, number) for number in range(CLIENTS)]
        while time.monotonic() - began < 4 or not all(each.done() for each in coming):
            text, seconds = get(metrics, 5)
            slowest = max(slowest, seconds)
            used.append(float(re.search(r"^ftcs_samples_used_total{.*} (\S+)$", text, re.M).group(1)))
            more = max(more, status(receiver.pid, "Threads") - threads)
            grown = max(grown, status(receiver.pid, "VmRSS") - memory)
            time.sleep(0.25)
    clients = [each.result() for each in coming]
    elapsed = time.monotonic() - began
    assert used[-1] - used[0] > 7 * elapsed, f"the loop was held up: {used} in {elapsed:.1f} s"  # of sixteen Syncs a second
    until_locked(ftcs, folder, receiver)
    assert more <= 1 and grown < 20_000, f"{more} threads, {grown} kB more"
    assert slowest < 2, f"metrics took {slowest} s"
    for connection in clients:
        connection.close()
    _, seconds = get(page, 30)
    print(f"{CLIENTS} clients: locked, metrics within {slowest * 1e3:.0f} ms, {more} threads and {grown} kB more; page after {seconds:.1f} s")


def main():
    ftcs = os.path.realpath(sys.argv[1])
    if not has_ipv6():
        print("skipped: no IPv6 on this machine")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        base = [ftcs, "ptp", "-i", "lo", "-S", "--event-port", str(PORT), "--general-port", str(PORT + 1), "--logAnnounceInterval", "-2"]
        quiet = dict(stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        transmitter = subprocess.Popen([*base, "--role", "time-transmitter", "--uds_address", "none", "--logSyncInterval", "-4",
                                        "--logMinDelayReqInterval", "-4"], **quiet)
        receiver = subprocess.Popen([*base, "--never-step", "--uds_address", f"{folder}/uds", "--web", f"[::1]:{PORT + 2}", "--metrics",
                                     str(PORT + 3)], **quiet)
        try:
            examine(ftcs, folder, receiver)
        finally:
            for process in (transmitter, receiver):
                process.terminate()
                process.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
