#!/bin/bash
# SPDX-License-Identifier: MIT
# A time receiver of ours follows a transmitter of ours over veth while forged frames come from the transmitter's side.
# Both clocks copy CLOCK_REALTIME, so that what the receiver tells a chronyd is its true error.
#
# test/hostile/ptp_receiver.sh [build/ftcs] [SECONDS of each attack] [ATTACK ...]
. "$(dirname "$0")/../interop/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
seconds=${2:-6}
shift $(($# < 2 ? $# : 2))
require ip python3
make_network
python3 "$(dirname "$0")/ptp_receiver.py" "$ftcs" "$seconds" "$folder" "$ours" "$our_interface" "$theirs" "$their_interface" "$@" ||
  fail "an attack passed a limit"
