#!/bin/bash
# SPDX-License-Identifier: MIT
# A cable, a link or an address that is late at boot: a receiver and a transmitter that start before it wait, say why and
# what mends it, tell their service manager that they live and not that they are ready, end at a signal, and lock once it is
# there. Without such an interface at all they refuse.
#
# test/interop/late_interface.sh [build/ftcs]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
require ip python3
make_network

fast=(--time_stamping software --tx_timestamp_timeout 50 --logAnnounceInterval -2 --logMinDelayReqInterval -3)
wait_for() {  # log, text
  local i
  for i in $(seq 200); do
    grep -q "$2" "$folder/$1.log" && return
    sleep 0.1
  done
  fail "no '$2' in $1.log"
}
status() {  # the sentence
  { ip netns exec "$1" "$ftcs" status --uds_address "$folder/$2" || true; } | grep "^in a sentence"  # not locked: 3
}

code=0
ip netns exec "$ours" "$ftcs" ptp -i nosuch0 > "$folder/nosuch.log" 2>&1 || code=$?
{ [ "$code" -eq 1 ] && grep -q "interface nosuch0: no such device" "$folder/nosuch.log"; } || fail "no such interface: code $code"

ip -n "$ours" link set "$our_interface" down
ip -n "$ours" address flush dev "$our_interface"
ip -n "$theirs" link set "$their_interface" down
python3 -c '
import socket, sys
manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
manager.bind(sys.argv[1])
while True:
    print(manager.recv(4096).decode(), flush=True)' "$folder/notify" > "$folder/manager.log" &
pids+=($!)
until [ -S "$folder/notify" ]; do sleep 0.05; done
ip netns exec "$theirs" "$ftcs" ptp -i "$their_interface" --role time-transmitter --logSyncInterval -3 "${fast[@]}" \
  --uds_address "$folder/theirs" > "$folder/transmitter.log" 2>&1 &
transmitter=$!
pids+=("$transmitter")
NOTIFY_SOCKET="$folder/notify" WATCHDOG_USEC=2000000 ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" "${fast[@]}" \
  --uds_address "$folder/ours" > "$folder/receiver.log" 2>&1 &
receiver=$!
pids+=("$receiver")

wait_for receiver "the interface is down; ip link set $our_interface up"
wait_for receiver "LISTENING to FAULTY"
wait_for manager "STATUS=not locked: $our_interface is down"
wait_for manager "WATCHDOG=1"
status "$ours" ours | grep -q "not locked: $our_interface is down; .*ip link set" || fail "status of the receiver"
wait_for transmitter "MASTER to FAULTY"
status "$theirs" theirs | grep -q "not transmitting: $their_interface is down; ip link set" || fail "status of the transmitter"
ip -n "$theirs" link set "$their_interface" up
wait_for transmitter "FAULTY to LISTENING"

ip -n "$ours" link set "$our_interface" up
wait_for receiver "ip address add ADDRESS/24 dev $our_interface or DHCP; or -2"
wait_for manager "STATUS=not locked: $our_interface has no IPv4 address"
status "$ours" ours | grep -q "$our_interface has no IPv4 address; .*-6 for IPv6" || fail "status without an address"
grep -q "^READY" "$folder/manager.log" && fail "ready without a lock"
[ "$(grep -c "link down" "$folder/receiver.log")" -eq 2 ] || fail "each reason is said once"

ip -n "$ours" address add "$our_address/24" dev "$our_interface"
wait_for receiver "UNCALIBRATED to SLAVE"
wait_for manager "^READY=1"
kill -INT "$receiver"
wait "$receiver" || fail "exit code $?, expected 0 (locked)"
grep -E "link|FAULTY|SLAVE on|summary" "$folder/receiver.log"

# A signal ends the wait.
ip -n "$ours" link set "$our_interface" down
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" "${fast[@]}" > "$folder/stopped.log" 2>&1 &
receiver=$!
wait_for stopped "LISTENING to FAULTY"
kill -INT "$receiver"
code=0
wait "$receiver" || code=$?
[ "$code" -eq 3 ] || fail "stopped while it waits: exit code $code, expected 3"
grep -q "not locked: $our_interface is down" "$folder/stopped.log" || fail "no reason at the end"

# The interface is up, and nothing at the other end of its cable: that is the reason, and not a transmitter that is off.
ip -n "$theirs" link set "$their_interface" down
ip -n "$ours" link set "$our_interface" up
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" "${fast[@]}" --uds_address "$folder/ours" > "$folder/carrier.log" 2>&1 &
receiver=$!
pids+=("$receiver")
wait_for carrier "port 1 ($our_interface): the link of $our_interface is down: no carrier"
status "$ours" ours | grep -q "not locked: the link of $our_interface is down: no carrier" || fail "status without a carrier"
ip -n "$theirs" link set "$their_interface" up
wait_for carrier "link up"
wait_for carrier "UNCALIBRATED to SLAVE"
