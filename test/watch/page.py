#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""page.py build/ftcs [FOLDER]: the live page of three daemons of this host in Chromium: two ftcs ptp on loopback, one ftcs ethercat run
with drives in software. Judged by the document: sentences, figures, plots that are drawn, nothing on the console; at the width of a
phone and in the dark. Then the page of a daemon that streams a hundred thousand points at once: memory stays. Screenshots go to
FOLDER. Exit code 77 without Chromium and its driver."""
import http.server
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from browser import Browser, available  # noqa: E402

PORT = 20000 + os.getpid() % 1300 * 9
processes = []


def start(*command):
    processes.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
    return processes[-1]


def demand(true, what):
    if not true:
        raise AssertionError(what)


def start_daemons(ftcs):
    base = [ftcs, "ptp", "-i", "lo", "--event-port", str(PORT + 6), "--general-port", str(PORT + 7), "--uds_address", "none",
            "--logAnnounceInterval", "-2"]
    start(*base, "--role", "time-transmitter", "--logSyncInterval", "-4", "--logMinDelayReqInterval", "-4")
    for servo in ("adaptive", "linuxptp-pi"):
        start(*base, "--offset", "1us", "--skew", "50ppm", "--servo", servo, "--never-step", "--web", str(PORT + 8))
        time.sleep(0.5)  # the first one has the first port
    start(ftcs, "ethercat-segment", "--udp", str(PORT + 5), "--drives", "4", "--priority", "0")
    time.sleep(0.5)
    start(ftcs, "ethercat", "run", "--udp", f"127.0.0.1:{PORT + 5}", "--cycle", "4ms", "--sync-interval", "200ms", "--gate", "2ms",
          "--duration", "0", "--drift-pulses", "500", "--priority", "0", "--lost-frame-limit", "1000", "--unlocked-limit", "1000", "-q",
          "--web", str(PORT + 8))


def drawn(name):
    """How many pixels of each canvas of that name are not empty, for each daemon."""
    return f"""[...document.querySelectorAll("canvas.{name}")].map((c) => {{
      const data = c.width && c.height ? c.getContext("2d").getImageData(0, 0, c.width, c.height).data : [];
      let count = 0; for (let i = 3; i < data.length; i += 4) count += data[i] > 0; return count; }})"""


def live(browser, folder):
    browser.open(f"http://127.0.0.1:{PORT + 8}/")
    browser.until('document.querySelectorAll("section.daemon").length === 3', 30)
    browser.until('[...document.querySelectorAll("section.daemon")].filter((s) => s.dataset.mode === "locked").length >= 2', 40)
    browser.until('[...document.querySelectorAll("section.daemon")].every((s) => Number(s.dataset.points) > 50)', 40)
    browser.until('[...document.querySelectorAll(".sentence")].some((p) => p.textContent.startsWith("locked: offset"))')
    demand(browser.run('[...document.querySelectorAll(".title")].some((t) => t.textContent.startsWith("ptp lo: locked"))'), "title")
    demand(browser.run('[...document.querySelectorAll("figure.margins")].filter((f) => !f.hidden).length') == 1, "margins of the drives")
    for name, least in (("offset", 3), ("rate", 3), ("histogram", 3), ("stability", 2), ("delay", 2), ("drives", 1)):
        pixels = browser.run(drawn(name))
        demand(sum(count > 500 for count in pixels) >= least, f"{name}: pixels {pixels}")
    browser.screenshot(os.path.join(folder, "light.png"))
    browser.run('(document.getElementById("log").click(), true)')
    browser.emulate(Emulation_setEmulatedMedia={"features": [{"name": "prefers-color-scheme", "value": "dark"}]},
                    Emulation_setDeviceMetricsOverride={"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True})
    time.sleep(1.5)
    demand(browser.run("document.documentElement.scrollWidth") <= 390, "the page is wider than a phone")
    demand(browser.run('getComputedStyle(document.body).backgroundColor') == "rgb(20, 23, 27)", "dark is not dark")
    browser.screenshot(os.path.join(folder, "phone-dark.png"))
    console = browser.console()
    demand(not console, f"console: {console}")
    for method in ("POST", "PUT", "DELETE"):
        try:
            urllib.request.urlopen(urllib.request.Request(f"http://127.0.0.1:{PORT + 8}/state", b"", method=method), timeout=5)
            demand(False, f"{method} is answered")
        except urllib.error.HTTPError as error:
            demand(error.code == 405, f"{method}: {error.code}")
    print("three daemons on one page, locked, drawn, silent console; phone and dark")


def wakes_up(browser):
    """A page that lost its daemon, and found too many others listening when it came back, shows it again by itself."""
    daemon = processes[1]
    command = daemon.args
    lost = 'document.querySelector("section.daemon").dataset.mode === "lost"'
    browser.open("about:blank")  # its listener is gone within a second
    time.sleep(1.5)
    browser.open(f"http://127.0.0.1:{PORT + 8}/")
    browser.until('document.querySelector("section.daemon")?.dataset.mode === "locked"', 30)
    daemon.terminate()
    daemon.wait()
    browser.until(lost)
    start(*command)
    listeners = []
    end = time.monotonic() + 20
    while len(listeners) < 4 and time.monotonic() < end:
        try:
            listeners.append(urllib.request.urlopen(f"http://127.0.0.1:{PORT + 8}/events", timeout=5))
        except OSError:
            time.sleep(0.02)
    time.sleep(4)  # the browser has asked again by itself, and was refused
    browser.until(lost)
    for listener in listeners:
        listener.close()
    browser.until('document.querySelector("section.daemon").dataset.mode === "locked"', 40)
    browser.console()  # refused connections are told there, rightly
    print("the page comes back by itself: daemon ended, started again, four other listeners before it")


class FastDaemon(http.server.BaseHTTPRequestHandler):
    """Serves the same page, and half an hour of 60 points a second as fast as it can."""
    page = b""
    sent = 0
    go = threading.Semaphore(0)

    def do_GET(self):
        if self.path == "/events":
            self.stream()
            return
        body = self.page if self.path == "/" else b"[]"
        self.send_response(200)
        self.send_header("Content-Type", "text/html" if self.path == "/" else "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def stream(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.end_headers()
        state = dict(program="ftcs", kind="ptp", target="fast", servo="adaptive", reference="r", mode="locked", cause="locked",
                     sentence="locked: fast", uptime_s=1, offset_ns=1, sigma_ns=1, bound_ns=1, rate_ppb=1, delay_ns=1, used=1,
                     refused=dict(outlier=0, duplicate=0, implausible=0), steps=0, holdovers=0, cycle=None,
                     histogram=dict(lowest_ns=0, width_ns=1, counts=[1, 2, 1]), adev=[[1, 1e-9], [2, 1e-9]], tdev=[[1, 1e-9], [2, 1e-9]])
        try:
            while True:
                FastDaemon.go.acquire()
                for _ in range(60):
                    points = [[(FastDaemon.sent + i) / 60, (FastDaemon.sent + i) % 97 - 48, 5, 3, 1000, 1] for i in range(300)]
                    FastDaemon.sent += 300
                    self.wfile.write(f"event: points\ndata: {json.dumps(points)}\n\nevent: state\ndata: {json.dumps(state)}\n\n".encode())
        except OSError:
            pass  # the browser has gone

    def log_message(self, *ignored):
        pass


def fast(browser):
    with urllib.request.urlopen(f"http://127.0.0.1:{PORT + 8}/", timeout=5) as answer:
        FastDaemon.page = answer.read()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), FastDaemon)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    browser.open(f"http://127.0.0.1:{server.server_address[1]}/")
    memory = []
    for turn in range(1, 7):  # six times 18,000 points: five minutes each
        FastDaemon.go.release()
        browser.until("((ring) => Math.round(ring.at(ring.size - 1, 0) * 60))(daemons.get(location.origin).ring) >= "
                      f"{turn * 18000 - 1}", 30)
        time.sleep(0.7)
        memory.append(browser.run("(gc(), gc(), performance.memory.usedJSHeapSize)"))
    nodes = browser.run('document.querySelectorAll("*").length')
    server.shutdown()
    demand(FastDaemon.sent == 108000, f"sent {FastDaemon.sent}")
    demand(memory[-1] - memory[1] < 1_000_000, f"the page grows: {memory} octets")
    demand(nodes < 200, f"{nodes} elements")
    print(f"{FastDaemon.sent} points (half an hour at 60 a second): heap {memory[1]} to {memory[-1]} octets, {nodes} elements")


def main():
    if not available():
        print("skipped: needs chromium and chromedriver (Debian: chromium-driver)")
        return 77
    folder = sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp()
    os.makedirs(folder, exist_ok=True)
    start_daemons(os.path.realpath(sys.argv[1]))
    browser = Browser()
    try:
        live(browser, folder)
        fast(browser)
        wakes_up(browser)
    finally:
        browser.close()
        for process in processes:
            process.terminate()
            process.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
