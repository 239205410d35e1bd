#!/bin/bash
# SPDX-License-Identifier: MIT
# Debian's ptp4l transmits over veth; behind one time receiver every servo steers a virtual clock of its own from the
# same packets (ftcs demo --interface). The truth is this machine's CLOCK_REALTIME, with which ptp4l stamps. Against
# linuxptp-pi and plain FTCS the adaptive servo must
# - in each of five runs lock no later, and have a lower true RMS from lock to the end, each servo from its own lock (its
#   own is the longest: from the second or third Sync on, while linuxptp-pi's leaves the first eight seconds out);
# - over the second half, the same time for all, have a lower true RMS in four of five runs and in all five together.
# Why not in every run: it had in 18 of 18 runs on a machine of two processors without load of our own, and in 17 of 18
# beside six busy shells (from lock on in all 36). Under load some messages take a tenth of the usual time (sender and
# receiver on one processor), and two such answers in a row were once taken for a change of frequency: 2.7 us for half a
# second.
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

OTHERS = ("linuxptp-pi", "ftcs")
wrong = 0
halves = {servo: [] for servo in ("adaptive", *OTHERS)}
for name in sys.argv[1:]:
    run = json.load(open(name))
    rows = {row["servo"]: row for row in run["ptp"]}
    cycles = {s: r["cycles_to_lock"] if r["locked"] else math.inf for s, r in rows.items()}
    print("  ".join(f"{s}: {r['rms_time_error_ns']:.0f} ns from lock, {r['rms_second_half_ns']:.0f} ns second half, "
                    f"{cycles[s]} cycles" for s, r in rows.items()), f" asymmetry {run['asymmetry_ns']:.0f} ns")
    for servo, of_runs in halves.items():
        of_runs.append(rows[servo]["rms_second_half_ns"])
    ours = rows["adaptive"]
    for other in OTHERS:
        if not ours["rms_time_error_ns"] < rows[other]["rms_time_error_ns"] or cycles["adaptive"] > cycles[other]:
            wrong += 1
            print(f"  {other} was better")
together = {servo: math.sqrt(sum(rms * rms for rms in runs) / len(runs)) for servo, runs in halves.items()}
print("second halves together: " + ", ".join(f"{servo} {rms:.0f} ns" for servo, rms in together.items()))
for other in OTHERS:
    lower = sum(ours < theirs for ours, theirs in zip(halves["adaptive"], halves[other]))
    if lower < len(halves[other]) - 1 or not together["adaptive"] < together[other]:
        wrong += 1
        print(f"  below {other} in the second half of {lower} runs only, or not together")
sys.exit(1 if wrong else 0)
PYTHON
