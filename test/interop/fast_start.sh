#!/bin/bash
# SPDX-License-Identifier: MIT
# Fast start against Debian's ptp4l over veth, end to end and peer to peer: our clock starts 1 ms away and 50 ppm fast,
# and from two Sync intervals after the first Sync that was heard on it is near the reference. ptp4l announces as often
# as it sends Sync. Two of three starts must show it: a busy machine can delay a stamp.
#
# test/interop/fast_start.sh [build/ftcs]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
mechanism=${3:-E2E}
require ip ptp4l python3
make_network
start_ptp4l transmitter "logAnnounceInterval -3" "logSyncInterval -3" "logMinDelayReqInterval -3" \
  "logMinPdelayReqInterval -3" "delay_mechanism $mechanism"
for i in $(seq 100); do  # until it transmits
  grep -q "to MASTER" "$folder/transmitter.log" && break
  [ "$i" -lt 100 ] || fail "ptp4l never transmits"
  sleep 0.1
done
sleep 1

good=0
for start in 1 2 3; do
  ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" --delay_mechanism "$mechanism" --servo ftcs --offset 1ms --skew 50ppm \
    --time_stamping software --tx_timestamp_timeout 50 --logMinDelayReqInterval -3 --duration 2 --json \
    > "$folder/start-$start.json" 2> "$folder/receiver.log" || true
  python3 - "$folder/start-$start.json" << 'PY' && good=$((good + 1))
import json, sys
offsets = [json.loads(line)["offset_ns"] for line in open(sys.argv[1])]
print("offsets of the first Syncs, ns:", offsets[:6])
later = offsets[2:8]
known = [offset for offset in offsets[:2] if offset is not None]
sys.exit(not (known and abs(known[0]) > 5e5 and len(later) == 6
              and all(o is not None and abs(o) < 5e4 for o in later)))
PY
done
echo "$mechanism: $good of 3 starts within two Sync intervals"
[ "$good" -ge 2 ] || fail "not within two Sync intervals of the first Sync"
