#!/bin/bash
# SPDX-License-Identifier: MIT
# Every transport with every delay mechanism against Debian's ptp4l over veth, both ways: follow_ptp4l.sh and
# ptp4l_follows.sh for each profile, each in namespaces of its own, those of one direction at the same time (a dozen
# messages a second each). One line a profile; the log of what failed.
#
# test/interop/profiles.sh [build/ftcs] [SECONDS]
set -uo pipefail
ftcs=$(realpath "${1:-build/ftcs}")
seconds=${2:-60}
here=$(dirname "$0")
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT

profiles=("UDPv4 E2E" "UDPv6 E2E" "L2 E2E" "UDPv4 P2P" "UDPv6 P2P" "L2 P2P" "UDPv4 hybrid" "L2 gptp")
failed=0
for script in follow_ptp4l ptp4l_follows; do
  pids=()
  for profile in "${profiles[@]}"; do
    # shellcheck disable=SC2086
    "$here/$script.sh" "$ftcs" "$seconds" $profile > "$results/$profile" 2>&1 &
    pids+=($!)
  done
  for i in "${!profiles[@]}"; do
    profile=${profiles[$i]}
    wait "${pids[$i]}"
    code=$?
    if [ "$code" -eq 77 ]; then
      cat "$results/$profile"
      skipped=1
    elif [ "$code" -ne 0 ]; then
      echo "$script, $profile: FAILED"
      cat "$results/$profile"
      failed=1
    else
      echo "$script, $profile: $(grep -E 'samples, median|offsets; slope' "$results/$profile"); $(grep tshark "$results/$profile")"
    fi
  done
  [ -n "${skipped:-}" ] && exit 77
done
exit $failed
