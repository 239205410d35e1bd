#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Propagation delays of a wiring, by walking a frame through it: wiring_delays.py line|tree DRIVES CABLE_NS HOP_NS
prints one number a SubDevice in the order in which a frame visits them, relative to the first."""
import sys

shape, drives, cable, hop = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
children = {n: {} for n in range(drives)}
for n in range(1, drives):
    parent, port = (n - 1, 1) if shape == "line" else ((n - 1) // 3, (n - 1) % 3 + 1)
    children[parent][port] = n
visits = []


def walk(device, time):
    """Enters at port 0, leaves by 3, 1, 2 where something hangs, and comes out of port 0 again."""
    visits.append(time)
    for port in (3, 1, 2):
        if port in children[device]:
            time = walk(children[device][port], time + hop + cable)
    return time + hop + cable


walk(0, 0)
print(" ".join(str(time) for time in visits))
