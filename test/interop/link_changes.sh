#!/bin/bash
# SPDX-License-Identifier: MIT
# The link of a time receiver goes down and up, and its interface is unplugged and comes back as another one; it
# locks again each time. Peer to peer, a link whose delay nobody tells is not steered by, though another one's was known.
# Both ends are ours, unicast but for that.
#
# test/interop/link_changes.sh [build/ftcs]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
require ip
make_network

fast=(--time_stamping software --tx_timestamp_timeout 50 --logAnnounceInterval -2 --logMinDelayReqInterval -3)
ip netns exec "$theirs" "$ftcs" ptp -i "$their_interface" --role time-transmitter --unicast "$our_address" \
  --logSyncInterval -3 "${fast[@]}" > "$folder/transmitter.log" 2>&1 &
pids+=($!)
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" --unicast 10.77.0.2 "${fast[@]}" \
  > "$folder/receiver.log" 2>&1 &
receiver=$!
pids+=("$receiver")

wait_for() {  # text, how often
  local i
  for i in $(seq 200); do
    [ "$(grep -c "$1" "$folder/receiver.log")" -ge "$2" ] && return
    sleep 0.1
  done
  fail "no '$1', time $2"
}

wait_for "UNCALIBRATED to SLAVE" 1
ip -n "$ours" link set "$our_interface" down
wait_for "to FAULTY on" 1
ip -n "$ours" link set "$our_interface" up
wait_for "UNCALIBRATED to SLAVE" 2

# Unplugged: the other end of the pair goes with it, so the transmitter's interface is replaced too.
ip -n "$ours" link delete "$our_interface"
wait_for "to FAULTY on" 2
wait_for "no such device" 1
ip link add "$our_interface" netns "$ours" type veth peer name "$their_interface" netns "$theirs"
ip -n "$ours" address add "$our_address/24" dev "$our_interface"
ip -n "$theirs" address add 10.77.0.2/24 dev "$their_interface"
ip -n "$ours" link set "$our_interface" up
ip -n "$theirs" link set "$their_interface" up
wait_for "UNCALIBRATED to SLAVE" 3
sleep 1  # a host that stands still for half a second here costs the lock once more

kill -INT "$receiver"
wait "$receiver" || fail "exit code $?, expected 0 (locked)"
grep -E "link|FAULTY|SLAVE on|summary" "$folder/receiver.log"

transmitter() {
  ip netns exec "$theirs" "$ftcs" ptp -i "$their_interface" --role time-transmitter --logSyncInterval -3 "${fast[@]}" "$@" \
    >> "$folder/transmitter.log" 2>&1 &
  transmitter=$!
  pids+=("$transmitter")
}
kill "${pids[0]}"
transmitter --delay_mechanism P2P
: > "$folder/receiver.log"
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" --delay_mechanism P2P "${fast[@]}" > "$folder/receiver.log" 2>&1 &
receiver=$!
pids+=("$receiver")
wait_for "UNCALIBRATED to SLAVE" 1
ip -n "$ours" link set "$our_interface" down
wait_for "to FAULTY on" 1
kill "$transmitter"
sleep 1  # longer than the lock lasts
transmitter --delay_mechanism E2E
ip -n "$ours" link set "$our_interface" up
wait_for "LISTENING to UNCALIBRATED" 2
sleep 3
grep -q "UNCALIBRATED to SLAVE" <(sed '1,/to FAULTY/d' "$folder/receiver.log") && fail "locked by the delay of another link"
kill -INT "$receiver"
code=0
wait "$receiver" || code=$?
[ "$code" -eq 3 ] || fail "without a link delay: exit code $code, expected 3"
