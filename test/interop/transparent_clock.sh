#!/bin/bash
# SPDX-License-Identifier: MIT
# ftcs ptp - veth - ptp4l as P2P transparent clock - veth - ptp4l as time transmitter: the neighbour is not the
# transmitter, so its stamps measure the link and no time (decision 0015). Then the same without the clock in between, where
# they are compared with the Syncs, and one line tells the outcome: an answer that software stamps at once may be quicker
# than a Sync, by more than its noise. Software timestamps, virtual clock.
#
# test/interop/transparent_clock.sh [build/ftcs] [SECONDS]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
duration=${2:-15}
require ip ptp4l
make_network

middle=ftcs-m-$$
remove_both() {
  remove_network
  ip netns delete "$middle" 2> /dev/null || true
}
trap remove_both EXIT
ip netns add "$middle"
link() {  # namespace, interface, namespace, interface
  ip link add "$2" netns "$1" type veth peer name "$4" netns "$3"
  ip -n "$1" link set "$2" up
  ip -n "$3" link set "$4" up
}
link "$ours" fc$$ "$middle" fd$$
link "$middle" fe$$ "$theirs" ff$$

p2p=("network_transport L2" "delay_mechanism P2P" "logSyncInterval -3" "logMinPdelayReqInterval -3")
receive() {  # interface, name of the log
  local code=0
  ip netns exec "$ours" "$ftcs" ptp -i "$1" -2 -P -S -s -m --offset 1ms --skew 50ppm --tx_timestamp_timeout 50 \
    --logMinPdelayReqInterval -3 --logAnnounceInterval -1 --duration "$duration" > "$folder/$2.log" 2>&1 || code=$?
  [ "$code" -eq 0 ] || fail "$2: exit code $code: not locked"
  grep -q "peer delay [0-9]* ns" "$folder/$2.log" || fail "$2: no peer delay"
  grep -E "summary|peer delay" "$folder/$2.log" || true
}
stamps="the transmitter's peer delay messages"

printf '%s\n' "[global]" "free_running 1" "time_stamping software" "clock_type P2P_TC" "tx_timestamp_timeout 50" \
  "fault_reset_interval -2" "uds_address $folder/middle.uds" "${p2p[@]}" "[fd$$]" "[fe$$]" > "$folder/middle.conf"
their_interface=ff$$ start_ptp4l far "priority1 1" "${p2p[@]}"
far=${pids[-1]}
ip netns exec "$middle" ptp4l -f "$folder/middle.conf" -m -q > "$folder/middle.log" 2>&1 &
pids+=($!)
receive fc$$ through
grep -q "$stamps" "$folder/through.log" && fail "the stamps of a transparent clock were taken for the transmitter's"
kill "$far"; wait "$far" 2> /dev/null || true

start_ptp4l near "${p2p[@]}"
receive "$our_interface" direct
grep -q "$stamps" "$folder/direct.log" || fail "the transmitter's own stamps were not judged"
