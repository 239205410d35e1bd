#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The kernel inside a bzImage, decompressed here, because the virtual machine is slower: vmlinux.py BZIMAGE VMLINUX.

Offsets are those of Documentation/arch/x86/boot.rst: setup_sects at 0x1f1, payload_offset at 0x248 (counted from the code of
protected mode), payload_length at 0x24c. The last four octets of the payload are the size of the kernel.
"""
import struct
import subprocess
import sys


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], "rb") as file:
        image = file.read()
    if image[0x202:0x206] != b"HdrS":
        sys.exit(f"{sys.argv[1]}: expected the header HdrS of a bzImage at 0x202, found {image[0x202:0x206].hex()}")
    start = (image[0x1F1] + 1) * 512 + struct.unpack_from("<I", image, 0x248)[0]
    length = struct.unpack_from("<I", image, 0x24C)[0] - 4
    payload = image[start:start + length]
    if payload[:4] != b"\x28\xb5\x2f\xfd":
        sys.exit(f"{sys.argv[1]}: expected a kernel compressed by zstd at {start}, found {payload[:4].hex()}")
    kernel = subprocess.run(["zstd", "-q", "-d", "-c"], input=payload, stdout=subprocess.PIPE, check=True).stdout
    if kernel[:4] != b"\x7fELF":
        sys.exit(f"{sys.argv[1]}: expected an ELF file in the payload, found {kernel[:4].hex()}")
    with open(sys.argv[2], "wb") as file:
        file.write(kernel)


main()
