#!/bin/bash
# SPDX-License-Identifier: MIT
# What systemd says of the sandbox of each unit, against the exposure that docs/install.md promises (tenths; 100 is the worst).
set -euo pipefail
command -v systemd-analyze > /dev/null || { echo "no systemd-analyze here"; exit 77; }
units=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for limit in ptp:20 phc:20 ethercat:16; do
  name=ftcs-${limit%:*}@eth0.service
  cp "$units/ftcs-${limit%:*}@.service" "$work/$name"
  # Exit code 1 above the threshold.
  systemd-analyze security --offline=yes --threshold="${limit#*:}" "$work/$name" > "$work/report" 2>&1 || {
    grep '✗' "$work/report"
    echo "$name: exposure above ${limit#*:} tenths" >&2
    exit 1
  }
  tail -1 "$work/report"
done
