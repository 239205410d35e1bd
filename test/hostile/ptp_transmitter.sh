#!/bin/bash
# SPDX-License-Identifier: MIT
# A time transmitter of ours is flooded with Delay_Req by one name, then by invented ones, while a receiver that was there
# before asks eight times a second: who is answered how often, and what it costs.
#
# test/hostile/ptp_transmitter.sh [build/ftcs] [SECONDS of each flood]
. "$(dirname "$0")/../interop/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
seconds=${2:-4}
require ip python3
make_network
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" -S --role time-transmitter --uds_address none \
  --duration $((2 * seconds + 4)) > "$folder/transmitter.log" 2>&1 &
transmitter=$!
pids+=("$transmitter")
sleep 2
ip netns exec "$theirs" python3 "$(dirname "$0")/ptp_transmitter.py" 10.77.0.2 "$seconds" "$transmitter" ||
  fail "answers: too many, or too few"
wait "$transmitter" || fail "the transmitter ended with $?"
sed -n 's/.*\(answers_refused [0-9]*\).*/\1/p' "$folder/transmitter.log" | grep . || fail "nothing was counted as refused"
