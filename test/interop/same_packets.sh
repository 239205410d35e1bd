#!/bin/bash
# SPDX-License-Identifier: MIT
# Debian's ptp4l transmits over veth; behind one time receiver every servo steers a virtual clock of its own from the
# same packets (ftcs demo --interface). The truth is this machine's CLOCK_REALTIME, with which ptp4l stamps. In each of
# five runs the adaptive servo must have a lower true RMS over the second half, when all have locked, than linuxptp-pi and
# plain FTCS, and lock no later.
#
# test/interop/same_packets.sh [build/ftcs] [SECONDS of one run]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
duration=${2:-20}
require ip ptp4l python3
make_network
start_ptp4l transmitter "logSyncInterval -3" "logMinDelayReqInterval -3"

# Nothing may steer this machine's clock meanwhile: raw against CLOCK_REALTIME.
difference() {
  python3 -c 'import time; print(max(time.clock_gettime_ns(time.CLOCK_REALTIME) -
    time.clock_gettime_ns(time.CLOCK_MONOTONIC_RAW) for _ in range(2000)))'
}

before=$(difference)
for run in 1 2 3 4 5; do
  ip netns exec "$ours" "$ftcs" demo --part ptp --interface "$our_interface" --duration "$duration" --no-live \
    --json "$folder/run$run.json" > "$folder/run$run.log" 2>&1 || fail "run $run: exit code $?"
done
after=$(difference)
[ $((after > before ? after - before : before - after)) -lt 20000 ] || skip "this machine's clock is being steered"

python3 - "$folder"/run*.json << 'PYTHON' || fail "the adaptive servo is not the best"
import json
import math
import sys

wrong = 0
for name in sys.argv[1:]:
    rows = {row["servo"]: row for row in json.load(open(name))["ptp"]}
    cycles = {s: r["cycles_to_lock"] if r["locked"] else math.inf for s, r in rows.items()}
    print("  ".join(f"{s}: {r['rms_second_half_ns']:.0f} ns, {cycles[s]} cycles" for s, r in rows.items()))
    ours = rows["adaptive"]
    for other in ("linuxptp-pi", "ftcs"):
        if not ours["rms_second_half_ns"] < rows[other]["rms_second_half_ns"] or cycles["adaptive"] > cycles[other]:
            wrong += 1
            print(f"  {other} was better")
sys.exit(1 if wrong else 0)
PYTHON
