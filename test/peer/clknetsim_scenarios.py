# SPDX-License-Identifier: MIT
"""What the nodes of clknetsim_table.py do to each other: delays and frequencies as clknetsim's expressions, and the limits."""
import math
import os
import random

START = 12.0  # s: by then a transmitter has been selected
FREE_RUNNING = 10.4  # s, until a transmitter has been selected
CYCLES = 1200
LINK = "10e-6"


def gaussian(sigma):
    return f"(* {sigma} (normal))"


def exponential(mean):
    return f"(* {mean} (exponential))"


def spikes(part):
    return f"{gaussian(100e-9)} (* 100e-6 (equal {part} (uniform) 0.0))"


def queue(load):
    """20 ns of jitter, and with probability `load` the wait in a queue of 120 us frames (M/M/1): Syncs come so seldom that
    one wait tells nothing of the next."""
    return f"{gaussian(20e-9)} (* {120e-6 / (1 - load)} (exponential) (equal {load} (uniform) 0.0))"


class Scenario:
    def __init__(self, name, interval=1.0, noise=100e-9, forward=None, backward=None, frequency=None, step=False,
                 goal=None, event=None, c5_band=None, wander=None):
        self.name, self.interval, self.step, self.goal, self.event = name, interval, step, goal or {}, event
        self.forward = forward or gaussian(noise)
        self.backward = backward or forward or gaussian(noise)
        self.frequency = frequency or (lambda rate: "50e-6")
        self.c5_band = c5_band or 5 * noise
        # What a filter may know: the noise in ns, the random walk of the frequency in ppb/sqrt(s); none: not gaussian.
        unknown = forward or event or (frequency and wander is None)
        self.known = None if unknown else (noise * 1e9, (wander or 0.0) * 1e9)
        self.rate = round(8 / interval)  # clock readings a second: eight a cycle
        self.length = START + CYCLES * interval
        self.event_time = START + 600.3 * interval

    def network(self, folder, seed):
        forward, backward, lines = self.forward, self.backward, []
        if self.event == "outage":
            drop = " (* -1 (equal 30 time 642))"
            forward, backward = forward + drop, backward + drop
        if self.event == "path":
            longer = f" (* 15e-6 (equal 1e6 time {self.event_time + 1e6}))"
            forward, backward = forward + longer, backward + longer
        if self.event == "reference":
            count = round(self.length * self.rate) + 2 * self.rate
            at = round(self.event_time * self.rate)
            path = os.path.join(folder, "steps")
            with open(path, "w") as steps:
                steps.write("\n".join("20e-6" if i == at else "0" for i in range(count)) + "\n")
            lines.append(f'node1_step = (file "{path}")')
        draw = random.Random(seed)
        return "\n".join(lines + [
            f"node1_start = {draw.uniform(0.0, 1.0):.6f}",
            f"node2_offset = {0.001 - 50e-6 * FREE_RUNNING}",  # 1 ms when the first Sync counts
            f"node2_freq = {self.frequency(self.rate)}",
            f"node1_delay2 = (+ {LINK} {forward})",
            f"node2_delay1 = (+ {LINK} {backward})"]) + "\n"


def walk(size):  # per sqrt(s)
    return lambda rate: f"(+ 50e-6 (sum (* {size / math.sqrt(rate)} (normal))))"


def square(cycles):
    return lambda rate: f"(+ 50e-6 (* 1e-6 (pulse {8 * cycles} {8 * cycles})))"


def sine(cycles):
    return lambda rate: f"(+ 50e-6 (* 0.5e-6 (sine {8 * cycles})))"


FAST = 0.125
SCENARIOS = [
    Scenario("g100 1 s step", step=True, goal={"c5": (2, None), "rms": (5, 12)}),
    Scenario("g100 1 s never step", goal={"c5": (2, None), "rms": (5, 12)}),
    Scenario("g100 125 ms never step", FAST, goal={"c5": (2, None), "rms": (5, 12)}),
    Scenario("g1000 125 ms step", FAST, noise=1e-6, step=True, goal={"rms": (45, 120)}),
    Scenario("e100 1 s", forward=exponential(100e-9), goal={"rms": (4, 8)}),
    Scenario("wander 1e-9 1 s", frequency=walk(1e-9), wander=1e-9, goal={"rms": (32, 40)}),
    Scenario("wander 1e-9 125 ms", FAST, frequency=walk(1e-9), wander=1e-9, goal={"rms": (15, 25)}),
    Scenario("wander 1e-8 1 s", frequency=walk(1e-8), wander=1e-8, goal={"rms": (58, 65)}),
    Scenario("wander 1e-8 125 ms", FAST, frequency=walk(1e-8), wander=1e-8, goal={"rms": (27, 35)}),
    Scenario("2 % +100 us 1 s", forward=spikes(0.02), goal={"rms": (10, 30), "max": (60, 100)}),
    Scenario("10 % +100 us 1 s", forward=spikes(0.1), goal={"rms": (10, None), "max": (60, 1000)}),
    Scenario("+-1 ppm steps 1 s", frequency=square(50), goal={"rms": (180, 230)}),
    Scenario("+-1 ppm steps 125 ms", FAST, frequency=square(50), goal={"rms": (85, 100)}),
    Scenario("sine 1 s", frequency=sine(75), goal={"rms": (95, 105)}),
    Scenario("sine 125 ms", FAST, frequency=sine(75), goal={"rms": (58, 65)}),
    Scenario("one-way load 1 s", forward=exponential(1e-6), backward=gaussian(100e-9), goal={"rms": (40, 60)}),
    Scenario("20 % load 125 ms", FAST, noise=20e-9, forward=queue(0.2), goal={"rms": (6, 10)}),
    Scenario("40 % load 125 ms", FAST, noise=20e-9, forward=queue(0.4), goal={"rms": (6, 10)}),
    Scenario("60 % load forward 125 ms", FAST, noise=20e-9, forward=queue(0.6), backward=gaussian(20e-9),
             goal={"rms": (6, 10)}),
    Scenario("40 % load 1 s", noise=20e-9, forward=queue(0.4), goal={"rms": (15, 25)}),
    Scenario("60 s outage", event="outage", goal={"rms": (10, 30)}),
    Scenario("20 us reference step", event="reference", goal={"after 3": (500, 1000), "overshoot": (1000, 1000)}),
    Scenario("15 us path change", event="path", goal={"max": (1000, 1000)}),
]
# The source of a clock comparison: a hardware clock whose reading is noisy.
PHC_SCENARIOS = [
    Scenario("phc g100 1 Hz step", step=True),
    Scenario("phc g100 1 Hz never step"),
    Scenario("phc g100 8 Hz step", FAST, step=True),
    Scenario("phc wander 1e-8 1 Hz", step=True, frequency=walk(1e-8)),
    Scenario("phc +-1 ppm steps 1 Hz", step=True, frequency=square(50)),
    Scenario("phc 2 % +100 us 1 Hz", step=True, forward=spikes(0.02)),
]
