#!/bin/bash
# SPDX-License-Identifier: MIT
# The cyclic path of `ftcs ethercat run` makes no system call beyond send, receive, clock and sleep: strace watches a run on
# loopback; between its first and its last sleep nothing else may stand. Skipped (77) without strace or the right to trace.
set -uo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
command -v strace > /dev/null || { echo "skipped: needs strace"; exit 77; }
folder=$(mktemp -d)
segment=
cleanup() {
  [ -n "$segment" ] && kill "$segment" 2> /dev/null
  wait 2> /dev/null
  rm -rf "$folder"
}
trap cleanup EXIT
strace -o "$folder/probe" true 2> /dev/null || { echo "skipped: may not trace here"; exit 77; }

port=$((20000 + $$ % 12000))
"$ftcs" ethercat-segment --udp "$port" --drives 2 > "$folder/segment" 2>&1 &
segment=$!
sleep 0.5
strace -f -o "$folder/trace" "$ftcs" ethercat run --udp "127.0.0.1:$port" --drives 2 -q --drift-pulses 50 --cycle 5ms \
  --gate 2ms --duration 3 > "$folder/run" 2>&1
code=$?
if [ $code -ne 0 ] && [ $code -ne 3 ] && [ $code -ne 1 ]; then
  cat "$folder/run"
  echo "FAILED: exit code $code"
  exit 1
fi
# "PID name(...": names between the first and the last sleep. clock_gettime is a system call only where the kernel has no vDSO clock.
# The thread that answers ftcs status, and that of a PTP receiver, have calls of their own.
awk '{ sub(/\(.*/, "", $2) }
     $2 == "clock_nanosleep" && !cycle { cycle = $1 }
     $1 == cycle { names[++lines] = $2; if ($2 == "clock_nanosleep") { if (!first) first = lines; last = lines } }
     END { for (n = first; n <= last; ++n) count[names[n]]++; for (name in count) print name, count[name] }' "$folder/trace" |
  sort > "$folder/calls"
cat "$folder/calls"
sleeps=$(awk '$1 == "clock_nanosleep" { print $2 }' "$folder/calls")
if [ "${sleeps:-0}" -lt 100 ]; then
  echo "FAILED: expected hundreds of cycles, saw ${sleeps:-0} sleeps"
  exit 1
fi
others=$(grep -vE '^(clock_nanosleep|sendto|recvmsg|ppoll|clock_gettime|---|\+\+\+|<\.\.\.) ' "$folder/calls")
if [ -n "$others" ]; then
  echo "FAILED: other system calls in the cyclic path: $others"
  exit 1
fi
echo "ok"
