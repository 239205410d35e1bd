#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""ptp_transmitter.py ADDRESS SECONDS PID: floods a transmitter with Delay_Req and counts its Delay_Resp."""
import os
import socket
import struct
import sys
import threading
import time

ADDRESS, SECONDS, PID = sys.argv[1], float(sys.argv[2]), sys.argv[3]
GROUP = "224.0.1.129"
HONEST = bytes.fromhex("0200000000000001")
EACH, STRANGERS, PLACES = 256, 1024, 64


def multicast(port):
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    made.bind(("", port))
    made.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                    socket.inet_aton(GROUP) + socket.inet_aton(ADDRESS))
    made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(ADDRESS))
    return made


def delay_req(clock, number):
    header = struct.pack(">BBHBBHq4x8sHHBb", 0x01, 0x02, 44, 0, 0, 0, 0, clock, 1, number & 0xFFFF, 1, 0x7F)
    return header + bytes(10)


def processor_seconds():
    fields = open(f"/proc/{PID}/stat").read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Answers(threading.Thread):
    """Counts Delay_Resp by whom they are for."""

    def __init__(self):
        super().__init__(daemon=True)
        self.honest = self.others = 0
        self.general = multicast(320)
        self.start()

    def run(self):
        while True:
            message = self.general.recv(1500)
            if len(message) < 54 or message[0] & 15 != 9:
                continue
            if message[44:52] == HONEST:
                self.honest += 1
            else:
                self.others += 1


def flood(answers, event, name, most):
    """Beside 8 requests a second of the honest one. Returns whether the limits were kept."""
    asked = sent = 0
    before = answers.honest, answers.others, processor_seconds()
    start = time.monotonic()
    while (now := time.monotonic() - start) < SECONDS:
        if asked < now * 8:
            event.sendto(delay_req(HONEST, asked), (GROUP, 319))
            asked += 1
        for _ in range(10):
            event.sendto(delay_req(name(sent), sent), (GROUP, 319))
            sent += 1
        time.sleep(0.001)
    time.sleep(0.5)
    honest, others = answers.honest - before[0], answers.others - before[1]
    cost = (processor_seconds() - before[2]) / SECONDS
    print(f"flood {sent / SECONDS:7.0f}/s  answered {others / SECONDS:6.0f}/s  "
          f"honest {honest} of {asked}  processor {100 * cost:.1f} %", flush=True)
    return honest >= asked - 1 and 0 < others <= most


def main():
    answers, event = Answers(), multicast(319)
    good = flood(answers, event, lambda n: bytes.fromhex("0200000000000bad"), EACH * (SECONDS + 1))
    invented = (SECONDS + 1) * STRANGERS + PLACES * EACH
    good &= flood(answers, event, lambda n: struct.pack(">Q", (3 << 56) + n), invented)
    sys.exit(0 if good else 1)


main()
