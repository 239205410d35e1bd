#!/bin/bash
# SPDX-License-Identifier: MIT
# One MainDevice a wire: a second one on the same wire is refused and disturbs nobody; one that comes past the lock leaves drives in OP
# alone unless it is told to take over, and sees that another one is bringing them up.
set -uo pipefail
ftcs=$(realpath "${1:-build/ftcs}")
folder=$(mktemp -d)
port=$((20000 + $$ % 12000))
"$ftcs" ethercat-segment --udp "$port" --drives 2 > "$folder/segment.log" 2>&1 &
segment=$!
main=
cleanup() { kill "$segment" $main 2> /dev/null; wait 2> /dev/null; rm -rf "$folder"; }
trap cleanup EXIT
fail() { echo "FAILED: $*"; tail -n 5 "$folder"/*.log; exit 1; }
sleep 0.5
"$ftcs" ethercat run --udp "127.0.0.1:$port" --cycle 4ms --gate 0 --drift-pulses 100 --lost-frame-limit 1000 --sync-error-limit 0 \
  --no-motion --duration 8 > "$folder/main.log" 2>&1 &
main=$!
for _ in $(seq 50); do grep -q "al 0x08" "$folder/main.log" && break; sleep 0.1; done
grep -q "al 0x08" "$folder/main.log" || fail "no OP"
"$ftcs" ethercat scan --udp "127.0.0.1:$port" > "$folder/second.log" 2>&1
[ $? -eq 1 ] && grep -q "another ftcs ethercat uses udp 127.0.0.1:$port" "$folder/second.log" || fail "the lock"
# Another name of the same host has another lock: 0.0.0.0 leads to 127.0.0.1 too.
"$ftcs" ethercat scan --udp "0.0.0.0:$port" > "$folder/other.log" 2>&1
code=$?
if [ $code -ne 1 ] || ! grep -q "are in OP already" "$folder/other.log"; then fail "drives in OP"; fi
wait "$main"
code=$?
main=
[ $code -eq 0 ] || fail "the first one ended with $code"
# In the bring-up, when nobody is in OP yet. The second one listens for a moment only: a host on which the first one stands
# still for so long hides it. Three attempts; what is wrong every time is wrong.
bring_up_is_seen() {
  "$ftcs" ethercat run --udp "127.0.0.1:$port" --cycle 4ms --gate 0 --drift-pulses 20000 --lost-frame-limit 1000 --sync-error-limit 0 \
    --no-motion --duration 3 > "$folder/main.log" 2>&1 &
  main=$!
  for _ in $(seq 50); do grep -q "clocks \.\.\." "$folder/main.log" && break; sleep 0.02; done
  "$ftcs" ethercat scan --udp "0.0.0.0:$port" > "$folder/other.log" 2>&1
  local seen=$? code
  wait "$main"
  code=$?
  main=
  [ $seen -eq 1 ] && grep -q "another MainDevice is at work" "$folder/other.log" && [ $code -eq 0 ]
}
bring_up_is_seen || bring_up_is_seen || bring_up_is_seen || fail "drives that are brought up"
echo "one main device a wire"
