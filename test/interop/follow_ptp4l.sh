#!/bin/bash
# SPDX-License-Identifier: MIT
# Our time receiver follows Debian's ptp4l over veth: two-step, software timestamps. Its virtual clock starts 1 ms away
# and 50 ppm fast.
#
# test/interop/follow_ptp4l.sh [build/ftcs] [SECONDS] [UDPv4|UDPv6|L2] [E2E|P2P|hybrid|gptp]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
duration=${2:-12}
transport=${3:-UDPv4}
mechanism=${4:-E2E}
require ip ptp4l tshark dumpcap
make_network
choose_profile "$transport" "$mechanism"
start_ptp4l transmitter "logSyncInterval -3" "logMinDelayReqInterval -3" "${theirs_too[@]}"
start_capture

code=0
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" -m -s --offset 1ms --skew 50ppm --time_stamping software \
  --tx_timestamp_timeout 50 --summary_interval -7 --duration "$duration" "${ours_too[@]}" \
  > "$folder/receiver.log" 2> "$folder/errors.log" || code=$?
check_receiver "$code" "$duration"
grep -qE "FAULT|timed out|bad message|ignoring" "$folder/transmitter.log" && fail "ptp4l reports a fault"
case $mechanism in
  P2P | gptp) grep -q "peer delay [0-9]* ns" "$folder/receiver.log" || fail "no peer delay" ;;
  hybrid) [ "$(packets 'ptp.v2.messagetype == 0x1 && ptp.v2.flags.unicast == 1 && ip.dst == 10.77.0.2')" -gt 0 ] ||
    fail "no unicast delay request" ;;
esac
grep -q "not 802.1AS capable" "$folder/receiver.log" && fail "ptp4l is not taken for capable"
check_capture
