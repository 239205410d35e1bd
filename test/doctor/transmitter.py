#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A PTP time transmitter that does one thing wrong: transmitter.py INTERFACE [FAULT=VALUE...]. Frames are made here and go
out by a raw socket, so that every layer can be wrong. Two-step, eight Syncs and four Announces a second, until it is ended.
Without a fault a receiver locks to it: times are CLOCK_REALTIME's, plus 37 s."""
import socket
import struct
import sys
import threading
import time

DEFAULTS = dict(transport="UDPv4", domain=0, sdo=0, version=2, vlan=0, group="", source="10.77.0.2", flags=0x0C, utc_offset=37,
                ahead=37.0, announce=1, sync=1, follow_up=1, delay_resp=1, pdelay_req=0, pdelay_resp=0, resp_to_others=0,
                unicast="", identity="0a0b0cfffe010203", twins=0, steps_removed=0, truncate=0, wander=0.0, priority1=128,
                turn=0, alternate=0, forward_wait=0.0)
UDP = {"UDPv4": 0x0800, "UDPv6": 0x86DD}
GROUPS = {"UDPv4": "01:00:5e:00:01:81", "UDPv6": "33:33:00:00:01:81", "L2": "01:1b:19:00:00:00"}
SYNC, DELAY_REQ, PDELAY_REQ, PDELAY_RESP, FOLLOW_UP, DELAY_RESP, PDELAY_RESP_FOLLOW_UP, ANNOUNCE = 0, 1, 2, 3, 8, 9, 10, 11


def mac(text):
    return bytes(int(part, 16) for part in text.split(":"))


def checksum(data):
    total = sum(struct.unpack(f"!{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


class Transmitter:
    def __init__(self, interface, settings):
        self.s = settings
        self.identity = bytes.fromhex(settings["identity"]) + b"\0\1"
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
        self.socket.bind((interface, 0))
        self.mac = self.socket.getsockname()[4]
        self.sequence = 0
        self.sent = 0

    def now(self):
        return time.time_ns() + int((self.s["ahead"] + self.s["wander"] * (self.sent % 2)) * 1e9)

    def stamp(self, ns):
        seconds, rest = divmod(ns, 10**9)
        return struct.pack("!HII", (seconds >> 32) & 0xFFFF, seconds & 0xFFFFFFFF, rest)

    def message(self, kind, sequence, body, flags=0, control=0, interval=-3):
        if self.s["alternate"]:
            flags |= 0x0100
        if self.s["version"] == 1:  # IEEE 1588-2002: a header of another kind
            return struct.pack("!HH", 1, 1) + b"_DFLT" + b"\0" * 120
        length = 34 + len(body)
        header = struct.pack("!BBHBBHqI10sHBb", self.s["sdo"] << 4 | kind, 0x12, length, self.s["domain"], 0, flags, 0, 0,
                             self.identity, sequence & 0xFFFF, control, interval)
        return (header + body)[: length - 10 * self.s["truncate"]]

    def send(self, message, event, group=None):
        s = self.s
        destination = mac(s["unicast"] or group or s["group"] or GROUPS[s["transport"]])
        frame = destination + self.mac
        if s["vlan"]:
            frame += struct.pack("!HH", 0x8100, s["vlan"])
        if s["transport"] == "L2":
            self.socket.send((frame + struct.pack("!H", 0x88F7) + message).ljust(60, b"\0"))
            return
        udp = struct.pack("!HHHH", 319 if event else 320, 319 if event else 320, 8 + len(message), 0)
        if s["transport"] == "UDPv4":
            to = s.get("unicast_ip") or "224.0.1.129"
            packet = struct.pack("!BBHHHBBH4s4s", 0x45, 0, 28 + len(message), 0, 0, 1, 17, 0, socket.inet_aton(s["source"]),
                                 socket.inet_aton(to))
            packet = packet[:10] + struct.pack("!H", checksum(packet)) + packet[12:]
        else:
            source, to = socket.inet_pton(socket.AF_INET6, "fe80::2"), socket.inet_pton(socket.AF_INET6, "ff0e::181")
            packet = struct.pack("!IHBB", 0x60000000, len(udp) + len(message), 17, 1) + source + to
            data = source + to + struct.pack("!II", len(udp) + len(message), 17) + udp + message
            udp = udp[:6] + struct.pack("!H", checksum(data + b"\0" * (len(data) % 2)) or 0xFFFF)
        self.socket.send(frame + struct.pack("!H", UDP[s["transport"]]) + packet + udp + message)

    def announce(self):
        s = self.s
        priority = s["priority1"] if not s["turn"] else (100 if int(time.time()) % 2 == 0 else 200)
        body = self.stamp(self.now()) + struct.pack("!hxBBBHB8sHB", s["utc_offset"], priority, 6, 0x21, 0x4E5D, 128,
                                                    self.identity[:8], s["steps_removed"], 0x20)
        self.send(self.message(ANNOUNCE, self.sequence, body, s["flags"], 5, -2), False)

    def sync(self):
        s = self.s
        self.sent += 1
        self.sequence += 1
        if s["sync"]:
            origin = self.now()
            time.sleep(s["forward_wait"])  # a path that takes longer in one direction
            self.send(self.message(SYNC, self.sequence, b"\0" * 10, 0x0200), True)
            if s["follow_up"]:
                self.send(self.message(FOLLOW_UP, self.sequence, self.stamp(origin), 0, 2), False)
        if s["pdelay_req"]:
            self.send(self.message(PDELAY_REQ, self.sequence, b"\0" * 20), True, s["transport"] == "L2" and "01:80:c2:00:00:0e")

    def answer(self, kind, sequence, requester):
        s = self.s
        if kind == DELAY_REQ and s["delay_resp"]:
            if s["resp_to_others"]:
                requester = b"\x77" * 10
            self.send(self.message(DELAY_RESP, sequence, self.stamp(self.now()) + requester, 0, 3), False)
        if kind == PDELAY_REQ:
            for _ in range(s["pdelay_resp"]):
                body = self.stamp(self.now()) + requester
                self.send(self.message(PDELAY_RESP, sequence, body, 0x0200, 5), True, "01:80:c2:00:00:0e")
                time.sleep(s.get("pdelay_wait", 0))
                body = self.stamp(self.now() - int(s.get("pdelay_lie", 0))) + requester
                self.send(self.message(PDELAY_RESP_FOLLOW_UP, sequence, body, 0, 5), False, "01:80:c2:00:00:0e")
                self.identity = self.identity[:8] + struct.pack("!H", self.identity[9] % 2 + 1) if s["pdelay_resp"] > 1 else self.identity

    def listen(self):
        while True:
            frame, address = self.socket.recvfrom(2048)
            if address[2] == socket.PACKET_OUTGOING:
                continue
            at = {b"\x88\xf7": 14, b"\x08\x00": 42, b"\x86\xdd": 62}.get(frame[12:14])
            if at is None or len(frame) < at + 34 or frame[at + 4] != self.s["domain"] or frame[at + 1] & 15 != 2:
                continue
            if frame[at] & 15 in (DELAY_REQ, PDELAY_REQ):
                self.answer(frame[at] & 15, struct.unpack("!H", frame[at + 30:at + 32])[0], frame[at + 20:at + 30])

    def run(self):
        threading.Thread(target=self.listen, daemon=True).start()
        turn = 0
        while True:
            if self.s["announce"] and turn % 2 == 0:
                self.announce()
            self.sync()
            if self.s["twins"]:  # the other one has counted from elsewhere and shows another time
                self.sequence += 30000
                self.s["ahead"] += 5.0 if turn % 2 == 0 else -5.0
            turn += 1
            time.sleep(0.125)


def main():
    settings = dict(DEFAULTS)
    for argument in sys.argv[2:]:
        name, value = argument.split("=", 1)
        kind = type(DEFAULTS.get(name, 0.0))
        settings[name] = value if kind is str or name == "unicast_ip" else kind(float(value)) if kind is float else int(value, 0)
    Transmitter(sys.argv[1], settings).run()


if __name__ == "__main__":
    main()
