#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""prometheus.py build/ftcs SECONDS: Debian's Prometheus scrapes an ftcs ptp and an ftcs ethercat run; each query of the dashboard must have
data, each rule of the alerts must be evaluated, and promtool must like metrics and rules. Exit code 77 without Prometheus."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MONITORING = os.path.join(TOP, "packaging", "monitoring")
PORT = 20000 + (os.getpid() % 1500) * 8  # below those that the kernel gives to whoever connects
processes = []


def start(folder, name, *command):
    with open(os.path.join(folder, name + ".log"), "w") as log:
        processes.append((name, subprocess.Popen(command, stdout=log, stderr=log)))


def ended(folder):
    """Whoever should still run and does not, and its last words."""
    gone = [(name, process.returncode) for name, process in processes if process.poll() is not None]
    for name, code in gone:
        with open(os.path.join(folder, name + ".log")) as log:
            print(f"{name} ended with {code}:\n" + "".join(log.readlines()[-12:]), flush=True)
    return [name for name, _ in gone]


def get(url):
    with urllib.request.urlopen(url, timeout=10) as answer:
        return answer.read().decode()


def start_daemons(ftcs, folder):
    base = [ftcs, "ptp", "-i", "lo", "--event-port", str(PORT), "--general-port", str(PORT + 1), "--uds_address", "none",
            "--logAnnounceInterval", "-2"]
    start(folder, "transmitter", *base, "--role", "time-transmitter", "--logSyncInterval", "-4", "--logMinDelayReqInterval", "-4")
    start(folder, "receiver", *base, "--offset", "1us", "--skew", "50ppm", "--metrics", str(PORT + 2), "--metrics-file", os.path.join(folder, "ftcs.prom"))
    start(folder, "segment", ftcs, "ethercat-segment", "--udp", str(PORT + 3), "--drives", "4", "--priority", "0")
    time.sleep(0.5)
    start(folder, "main-device", ftcs, "ethercat", "run", "--udp", f"127.0.0.1:{PORT + 3}", "--cycle", "4ms", "--sync-interval", "200ms", "--gate", "2ms",
          "--duration", "0", "--drift-pulses", "500", "--priority", "0", "--lost-frame-limit", "1000", "--unlocked-limit", "1000", "-q",
          "--metrics", str(PORT + 4))


def start_prometheus(folder):
    config = os.path.join(folder, "prometheus.yml")
    with open(config, "w") as file:
        file.write(f"""global: {{scrape_interval: 1s, evaluation_interval: 1s}}
rule_files: ["{MONITORING}/ftcs-alerts.yml"]
scrape_configs:
  - job_name: ftcs
    static_configs: [{{targets: ["127.0.0.1:{PORT + 2}", "127.0.0.1:{PORT + 4}"]}}]
""")
    start(folder, "prometheus", "prometheus", f"--config.file={config}", f"--storage.tsdb.path={folder}/data", f"--web.listen-address=127.0.0.1:{PORT + 5}")


def promtool(*arguments, text=None):
    done = subprocess.run(["promtool", *arguments], input=text, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def query(expression):
    url = f"http://127.0.0.1:{PORT + 5}/api/v1/query?" + urllib.parse.urlencode({"query": expression})
    return json.loads(get(url))["data"]["result"]


def check(failures, true, what):
    print("ok    " if true else "FAILED", what, flush=True)
    if not true:
        failures.append(what)


def judge(folder):
    failures = []
    for port in (PORT + 2, PORT + 4):
        code, said = promtool("check", "metrics", text=get(f"http://127.0.0.1:{port}/metrics"))
        check(failures, code == 0 and not said.strip(), f"promtool check metrics, port {port}: {said.strip() or 'clean'}")
    with open(os.path.join(folder, "ftcs.prom")) as file:
        code, said = promtool("check", "metrics", text=file.read())
    check(failures, code == 0 and not said.strip(), f"promtool check metrics, file: {said.strip() or 'clean'}")
    code, said = promtool("check", "rules", f"{MONITORING}/ftcs-alerts.yml")
    check(failures, code == 0, "promtool check rules")
    with open(f"{MONITORING}/ftcs-dashboard.json") as file:
        dashboard = json.load(file)
    for panel in dashboard["panels"]:
        for target in panel["targets"]:
            found = query(target["expr"].replace("$clock", ".*"))
            check(failures, len(found) > 0, f"{panel['title']}: {len(found)} series of {target['expr']}")
    groups = json.loads(get(f"http://127.0.0.1:{PORT + 5}/api/v1/rules"))["data"]["groups"]
    rules = [rule for group in groups for rule in group["rules"]]
    check(failures, len(rules) > 5 and all(rule["health"] == "ok" for rule in rules), f"{len(rules)} alert rules evaluated")
    firing = [rule["name"] for rule in rules if rule["state"] == "firing" and rule["name"] != "FtcsNotLocked"]
    check(failures, "FtcsGone" not in firing, f"firing: {firing or 'none'}")
    return failures


def main():
    if not all(map(shutil.which, ("prometheus", "promtool"))):
        print("skipped: needs prometheus and promtool (Debian: prometheus)")
        return 77
    folder = tempfile.mkdtemp()
    try:
        start_daemons(os.path.realpath(sys.argv[1]), folder)
        start_prometheus(folder)
        end = time.monotonic() + float(sys.argv[2])
        while time.monotonic() < end and not ended(folder):
            time.sleep(1)
        gone = ended(folder)
        failures = [f"{name} ended early" for name in gone] or judge(folder)
    finally:
        for _, process in processes:
            process.terminate()
            process.wait()
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
