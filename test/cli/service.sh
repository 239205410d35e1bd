#!/bin/bash
# SPDX-License-Identifier: MIT
# What the daemons tell a service manager, heard on a socket in systemd's place: a sentence at once, ready at the lock and only then.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/common.sh"

# listen NAME: every datagram as a line of $folder/NAME.
listen() {
  python3 -c '
import socket, sys
manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
manager.bind(sys.argv[1])
while True:
    print(manager.recv(4096).decode(), flush=True)' "$folder/$1.socket" > "$folder/$1" &
  pids+=($!)
  for _ in $(seq 100); do [ -S "$folder/$1.socket" ] && return; sleep 0.1; done
  fail "no socket $1"
}
ready_after_lock() {  # NAME
  head -1 "$folder/$1" | grep -q '^STATUS=not locked' || fail "$1: the first word is not why it is not locked"
  [ "$(grep -c '^READY=1' "$folder/$1")" -eq 1 ] || fail "$1: ready is not told exactly once"
  grep -B1 '^READY=1' "$folder/$1" | grep -qE '^STATUS=(locked: |in phase, but a drive is not in OP)' ||
    fail "$1: ready, but not locked"
}

port=$((20000 + $$ % 4000))
"$ftcs" ethercat-segment --udp "$port" --drives 2 --priority 70 > "$folder/segment" 2>&1 &
pids+=($!)
listen ethercat
sleep 0.5
NOTIFY_SOCKET="$folder/ethercat.socket" "$ftcs" ethercat run --udp "127.0.0.1:$port" --cycle 4ms --sync-interval 200ms \
  --gate 2ms --duration 8 --drift-pulses 500 -q > "$folder/run" 2>&1
ready_after_lock ethercat
grep -q '^STOPPING=1' "$folder/ethercat" || fail "the end is not told"
echo "ethercat: $(grep '^STATUS=locked' "$folder/ethercat" | tail -1)"

listen ptp
ptp() { exec "$ftcs" ptp -i lo --event-port $((port + 4000)) --general-port $((port + 8000)) --uds_address none "$@"; }
NOTIFY_SOCKET="$folder/ptp.socket" ptp --offset 1ms --skew 50ppm --logAnnounceInterval -2 --duration 14 > "$folder/receiver" 2>&1 &
receiver=$!
sleep 4
grep -q '^READY=1' "$folder/ptp" && fail "ready without a time transmitter"
grep -q '^STATUS=not locked: no Announce yet after 0' "$folder/ptp" || fail "ptp: blames somebody at once"
grep -q '^STATUS=not locked: no time transmitter was heard on lo, domain 0' "$folder/ptp" || fail "ptp: no sentence"
ptp --role time-transmitter --logSyncInterval -4 --logAnnounceInterval -2 --logMinDelayReqInterval -4 > "$folder/transmitter" 2>&1 &
pids+=($!)
wait $receiver
ready_after_lock ptp
echo "ptp: $(grep '^STATUS=locked' "$folder/ptp" | tail -1)"
