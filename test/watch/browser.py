# SPDX-License-Identifier: MIT
"""Headless Chromium by its chromedriver, over plain HTTP: no library is needed."""
import base64
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request


def available():
    return shutil.which("chromium") and shutil.which("chromedriver")


class Browser:
    def __init__(self, width=1200, height=1000, dark=False):
        self.folder = tempfile.mkdtemp()
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        port = None
        for line in self.driver.stdout:
            if "started successfully on port" in line:
                port = line.split()[-1].rstrip(".")
                break
        self.base = f"http://127.0.0.1:{port}/session"
        arguments = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", f"--window-size={width},{height}",
                     "--enable-precise-memory-info", "--js-flags=--expose-gc", f"--user-data-dir={self.folder}",
                     "--disable-background-networking", "--no-first-run"] + (["--force-dark-mode"] if dark else [])
        options = {"args": arguments, "binary": shutil.which("chromium")}
        capabilities = {"alwaysMatch": {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}
        self.base += "/" + self.post("", {"capabilities": capabilities})["sessionId"]

    def request(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def post(self, path, body):
        return self.request("POST", path, body)

    def open(self, url):
        self.post("/url", {"url": url})

    def run(self, script):
        return self.post("/execute/sync", {"script": "return (" + script + ");", "args": []})

    def until(self, script, seconds=20):
        """The script's value once it is true."""
        value = None
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.run(script)
            if value:
                return value
            time.sleep(0.2)
        raise AssertionError(f"not within {seconds} s: {script}; last: {value}")

    def console(self):
        """What pages said, less the browser's own (chrome://), which a slow machine makes talk."""
        messages = [entry["message"] for entry in self.post("/se/log", {"type": "browser"})]
        return [message for message in messages if not message.startswith("chrome://")]

    def emulate(self, **features):
        """prefers-color-scheme and the size of the screen, by the browser's own protocol."""
        for command, parameters in features.items():
            self.post("/goog/cdp/execute", {"cmd": command.replace("_", "."), "params": parameters})

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.request("GET", "/screenshot")))

    def close(self):
        try:
            self.request("DELETE", "")
        finally:
            self.driver.terminate()
            self.driver.wait()
            shutil.rmtree(self.folder, ignore_errors=True)
