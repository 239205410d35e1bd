#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What a capture of EtherCAT frames tells of a MainDevice, whoever wrote it.

  ethercat_capture.py phase FILE CYCLE_NS SHIFT_NS   the latches of the system time, against whole cycles plus a shift:
                                                     where they settle (centre), when, and how far they scatter about it
  ethercat_capture.py range FILE OFFSET              of a 32-bit number in the inputs (LRD or LRW), bytes from their start
"""
import struct
import sys

LRD, LRW, FPRD, FRMW = 10, 12, 4, 14
LOCK_NS = 30_000  # for jittery hosts: a running median of 51 frames that stays within it for a second of 1 ms
MEDIAN = 51
STAYS = 1000


def datagrams(path):
    """(seconds, command, address, data, working counter) of each datagram in a classic pcap file."""
    with open(path, "rb") as file:
        magic = struct.unpack("<I", file.read(24)[:4])[0]
        unit = {0xA1B2C3D4: 1e-6, 0xA1B23C4D: 1e-9}[magic]
        while len(header := file.read(16)) == 16:
            seconds, fraction, size, _ = struct.unpack("<IIII", header)
            frame = file.read(size)
            if frame[12:14] != b"\x88\xa4":
                continue
            end = 16 + (struct.unpack_from("<H", frame, 14)[0] & 0x7FF)
            at = 16
            while at + 12 <= min(end, len(frame)):
                command, _, address, length = struct.unpack_from("<BBIH", frame, at)
                data = frame[at + 10:at + 10 + (length & 0x7FF)]
                counter = struct.unpack_from("<H", frame, at + 10 + len(data))[0]
                yield seconds + fraction * unit, command, address, data, counter
                at += 12 + len(data)
                if not length & 0x8000:
                    break


def latches(path):
    """System times that the reference put into frames which came back."""
    return [struct.unpack("<Q", data)[0] for _, command, address, data, counter in datagrams(path)
            if command in (FRMW, FPRD) and address >> 16 == 0x0910 and len(data) == 8 and counter > 0]


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def cyclic_part(times, cycle):
    """From the first to the last frame around which frames are a cycle apart: bring-up and drift pulses are not."""
    gaps = [after - before for before, after in zip(times, times[1:])]
    regular = [i for i in range(len(gaps) - MEDIAN)
               if cycle // 2 < sorted(gaps[i:i + MEDIAN])[MEDIAN // 2] < 2 * cycle]
    return times[regular[0]:regular[-1] + MEDIAN] if regular else []


def phase(path, cycle, shift):
    times = cyclic_part(latches(path), cycle)
    if len(times) < 2 * MEDIAN:
        sys.exit(f"ethercat_capture: only {len(times)} latches in a row")
    errors = [(time - shift + cycle // 2) % cycle - cycle // 2 for time in times]
    half = len(errors) // 2
    # A constant lateness is what the shift is for: the centre is told, scatter and lock are about it.
    centre = quantile(errors[half:], 0.5)
    out = [i for i in range(len(errors) - MEDIAN)
           if abs(sorted(errors[i:i + MEDIAN])[MEDIAN // 2] - centre) > LOCK_NS]
    lock = next((before + 1 for before, after in zip([-1, *out], [*out, len(errors)]) if after - before > STAYS), half)
    later = sum(i > lock for i in out)
    scatter = [abs(error - centre) for error in errors[half:]]
    locked = lock < half
    settled = (f"settled (median of {MEDIAN} within 30 us) from frame {lock} on, outside again for {later}" if locked
               else "not settled in the first half")
    print(f"frames on the wire: {len(errors)}, first {errors[0] / 1000:+.1f} us, {settled}; centre {centre / 1000:+.1f} us, "
          f"second half about it p50 {quantile(scatter, 0.5) / 1000:.1f} p90 {quantile(scatter, 0.9) / 1000:.1f} p99 "
          f"{quantile(scatter, 0.99) / 1000:.1f} us")
    sys.exit(0 if locked else 3)


def span(path, offset):
    values = [struct.unpack_from("<i", data, offset)[0] for _, command, _, data, counter in datagrams(path)
              if command in (LRD, LRW) and counter > 0 and len(data) >= offset + 4]
    print(min(values), max(values))


if sys.argv[1:2] == ["phase"] and len(sys.argv) == 5:
    phase(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
elif sys.argv[1:2] == ["range"] and len(sys.argv) == 4:
    span(sys.argv[2], int(sys.argv[3]))
else:
    sys.exit(__doc__)
