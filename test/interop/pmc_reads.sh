#!/bin/bash
# SPDX-License-Identifier: MIT
# Debian's pmc asks our time receiver through its management socket, while it follows Debian's ptp4l over veth: each
# data set's fields are compared with what `ftcs status`, ptp4l's own answers and the configuration say. Then tshark
# reads our answers, and what is not a request is counted and survived.
#
# test/interop/pmc_reads.sh [build/ftcs]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
require ip ptp4l pmc tshark text2pcap python3
make_network
start_ptp4l transmitter "logSyncInterval -3" "logMinDelayReqInterval -3" "priority1 77" "clockClass 52" \
  "clockAccuracy 0x21" "utc_offset 37"

# Always in the background: the process becomes the program, so that its pid takes the signals.
receive() { exec ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" -s -S --servo adaptive --tx_timestamp_timeout 50 "$@"; }
receive --offset 1ms --skew 20ppm --uds_address "$folder/ftcs.uds" \
  > "$folder/receiver.log" 2>&1 &
receiver=$!
pids+=("$receiver")

status() { "$ftcs" status -s "$folder/ftcs.uds" "$@"; }
for _ in $(seq 75); do
  status > "$folder/status.log" 2>&1 && break
  sleep 0.2
done
status > "$folder/status.log" || fail "ftcs status: exit code $?, expected 0 (locked)"
cat "$folder/status.log"

ask() {  # socket of a PTP daemon, what
  pmc -u -b 0 -s "$1" -i "$folder/pmc.uds" "GET $2" > "$folder/pmc.txt" 2>&1
  cat "$folder/pmc.txt"
}
sets="NULL_MANAGEMENT CLOCK_DESCRIPTION USER_DESCRIPTION DEFAULT_DATA_SET CURRENT_DATA_SET PARENT_DATA_SET \
TIME_PROPERTIES_DATA_SET PORT_DATA_SET DOMAIN TIME_STATUS_NP PORT_DATA_SET_NP PORT_PROPERTIES_NP PORT_STATS_NP"
for set in $sets; do
  ask "$folder/ftcs.uds" "$set" > "$folder/ours.$set"
  ask "$folder/transmitter.uds" "$set" > "$folder/theirs.$set"
done
status --json > "$folder/status.json" || fail "ftcs status --json: exit code $?"
ask "$folder/ftcs.uds" PRIORITY1 | grep -q "MANAGEMENT_ERROR_STATUS" || fail "PRIORITY1 is not refused"
pmc -u -b 0 -s "$folder/ftcs.uds" -i "$folder/pmc.uds" "SET PRIORITY1 3" > "$folder/set.log" 2>&1
grep -q "MANAGEMENT_ERROR_STATUS" "$folder/set.log" || fail "SET is not refused"
[ "$(pmc -u -b 0 -d 5 -s "$folder/ftcs.uds" -i "$folder/pmc.uds" "GET DOMAIN" | grep -c RESPONSE)" -eq 0 ] \
  || fail "another domain is answered"

python3 "$(dirname "$0")/pmc_reads.py" "$folder" "$our_interface" || fail "data sets"

# A second instance at the same socket is refused; the first goes on.
code=0
receive --uds_address "$folder/ftcs.uds" --duration 1 > "$folder/second.log" 2>&1 &
wait $! || code=$?
[ "$code" -eq 1 ] || fail "a second instance on the same socket: exit code $code, expected 1"
grep -q "ftcs.uds: already in use" "$folder/second.log" || fail "no clear error of the second instance"
# It answers: 0 locked, 3 not locked at this moment, as on a host that is busy with the second instance.
status > "$folder/status.log" || [ $? -eq 3 ] || fail "the first instance does not answer any more"

kill -INT "$receiver"
wait "$receiver" || fail "the receiver's exit code is $?"
[ -e "$folder/ftcs.uds" ] && fail "the socket is left behind"
code=0
status > "$folder/status.log" 2>&1 || code=$?
[ "$code" -eq 1 ] || fail "ftcs status without an instance: exit code $code, expected 1"
[ "$(wc -l < "$folder/status.log")" -eq 1 ] || fail "more or less than one line of error"
# Peer to peer, our transmitter and ptp4l's receiver in a domain of their own: PORT_DATA_SET says what is in use.
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" --role time-transmitter -S -P --domainNumber 5 \
  --logMinPdelayReqInterval -2 --tx_timestamp_timeout 50 --uds_address "$folder/ftcs.uds" > "$folder/p2p.log" 2>&1 &
transmitter=$!
pids+=("$transmitter")
start_ptp4l p2p_receiver "slaveOnly 1" "delay_mechanism P2P" "domainNumber 5" "logMinPdelayReqInterval -2"
port() { pmc -u -d 5 -b 0 -s "$1" -i "$folder/pmc.uds" "GET PORT_DATA_SET" 2> /dev/null | sed -n "s/^\t\t$2 *//p"; }
# Single exchanges of software stamps may show anything, also less than nothing: one that can be is waited for.
for _ in $(seq 75); do
  delay=$(port "$folder/ftcs.uds" peerMeanPathDelay)
  [[ "$delay" =~ ^[1-9][0-9]{2,5}$ ]] && break
  sleep 0.2
done
[[ "$delay" =~ ^[1-9][0-9]{2,5}$ ]] || fail "peerMeanPathDelay is '$delay' ns"
[ "$(port "$folder/p2p_receiver.uds" delayMechanism)" = 2 ] || fail "ptp4l does not measure peer to peer"
for field in delayMechanism logMinPdelayReqInterval; do
  mine=$(port "$folder/ftcs.uds" "$field") wanted=$(port "$folder/p2p_receiver.uds" "$field")
  [ "$mine" = "$wanted" ] || fail "PORT_DATA_SET of a peer-to-peer transmitter: $field '$mine', ptp4l has '$wanted'"
done
kill -INT "$transmitter"
wait "$transmitter" || fail "the transmitter's exit code is $?"
echo "pmc reads our data sets, ftcs status agrees, a second instance is refused"
