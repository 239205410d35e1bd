# SPDX-License-Identifier: MIT
"""Sends each PTP message that leaves an interface by UDPv4 once more, some seconds later, until it is ended.

replay.py INTERFACE ADDRESS SECONDS"""
import collections, select, socket, sys, time

interface, address, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3])
OUTGOING = 4
heard = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(3))
heard.bind((interface, 3))
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 0)
waiting = collections.deque()
while True:
    select.select([heard], [], [], 0.005)
    while select.select([heard], [], [], 0)[0]:
        packet, (_, _, kind, _, _) = heard.recvfrom(2048)
        port = int.from_bytes(packet[22:24], "big")
        if kind != OUTGOING or len(packet) < 72 or packet[9] != 17 or port not in (319, 320):
            continue
        if int.from_bytes(packet[20:22], "big") == out.getsockname()[1]:
            continue  # ours
        waiting.append((time.monotonic() + seconds, port, packet[28:]))
    while waiting and waiting[0][0] <= time.monotonic():
        _, port, message = waiting.popleft()
        out.sendto(message, ("224.0.1.129", port))
