#!/bin/bash
# SPDX-License-Identifier: MIT
# Debian's chronyd takes our samples through its SOCK and SHM reference clocks. chronyd runs with -x: it steers no
# clock. Our transmitter is 3 ms ahead of this machine's clock, so chronyd must find the system clock 3 ms slow.
#
# test/interop/beside_chrony.sh [build/ftcs] [SECONDS]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
duration=${2:-25}
require ip chronyd chronyc unshare python3
unshare --ipc true 2> /dev/null || skip "may not make IPC namespaces"
make_network

ahead=3ms
ip netns exec "$theirs" "$ftcs" ptp -i "$their_interface" -S --role time-transmitter --offset $ahead \
  --logSyncInterval -3 --logMinDelayReqInterval -3 --logAnnounceInterval -2 --uds_address none \
  > "$folder/transmitter.log" 2>&1 &
pids+=($!)

cat > "$folder/chrony.conf" << END
refclock SOCK $folder/chrony.sock refid SOCK poll 0 filter 8 precision 1e-6 prefer
refclock SHM 7 refid SHM7 poll 0 filter 8
cmdport 0
port 0
bindcmdaddress $folder/chronyd.sock
pidfile $folder/chronyd.pid
logdir $folder
log refclocks tracking
END
# ptp4l with software timestamps announces an arbitrary timescale: --allow-epoch.
# Both in one IPC namespace of their own: the segment goes with it.
cat > "$folder/both.sh" << END
chronyd -x -d -u root -f "$folder/chrony.conf" > "$folder/chronyd.log" 2>&1 &
echo \$! > "$folder/chronyd.child"
exec "$ftcs" ptp -i "$our_interface" -s -S --offset 1ms --skew 20ppm --allow-epoch --chrony-sock "$folder/chrony.sock" --ntp-shm 7 \
  --uds_address "$folder/ftcs.uds" --summary_interval 2
END
ip netns exec "$ours" unshare --ipc bash "$folder/both.sh" > "$folder/receiver.log" 2>&1 &
both=$!
pids+=("$both")
for _ in $(seq 50); do [ -s "$folder/chronyd.child" ] && break; sleep 0.1; done
pids+=("$(cat "$folder/chronyd.child")")

ask() { chronyc -h "$folder/chronyd.sock" -n "$@"; }
reached() { [ "$(ask -c sources 2> /dev/null | awk -F, '$6 == "377"' | wc -l)" -eq 2 ]; }
for _ in $(seq $((duration * 5))); do
  reached && break
  sleep 0.2
done
ask sources || true
ask tracking > "$folder/tracking.out" || true
ask -c sources > "$folder/sources.csv" || true
reached || fail "reach is not 377"
"$ftcs" status -s "$folder/ftcs.uds" --json > "$folder/status.json" || fail "ftcs status: exit code $?"
cat "$folder/tracking.out"

python3 - "$folder" << 'END' || fail "what chronyd makes of the samples"
import csv, json, statistics, sys
folder = sys.argv[1]
sources = {row[2]: row for row in csv.reader(open(f"{folder}/sources.csv"))}
assert set(sources) == {"SOCK", "SHM7"}, sources
assert sources["SOCK"][1] == "*", "SOCK is not selected"
raw = {"SOCK": [], "SHM7": []}
for line in open(f"{folder}/refclocks.log"):
    fields = line.split()
    # date, time, refid, driver poll, leap, pulse, raw offset, cooked offset, dispersion
    if len(fields) == 9 and fields[2] in raw and fields[3] != "-":
        raw[fields[2]].append(float(fields[6]))
for name, offsets in raw.items():
    settled = offsets[len(offsets) // 2:]
    middle = statistics.median(settled)
    print(f"{name}: {len(offsets)} samples, median raw offset {middle * 1e6:.1f} us, "
          f"spread {statistics.pstdev(settled) * 1e6:.2f} us")
    # Each Sync is a sample for SOCK; chronyd looks into the shared memory once a second.
    assert len(offsets) >= (40 if name == "SOCK" else 6), "samples are missing"
    # chrony's refclocks log: positive, the system clock is slow.
    assert abs(middle - 3e-3) < 100e-6, f"{name}: {middle}"
tracking = dict(line.split(" : ", 1) for line in open(f"{folder}/tracking.out") if " : " in line)
reference = next(value for key, value in tracking.items() if key.startswith("Reference ID"))
assert "SOCK" in reference, reference
system = next(value for key, value in tracking.items() if key.startswith("System time"))
assert "slow" in system and abs(float(system.split()[0]) - 3e-3) < 100e-6, system
leap = next(value for key, value in tracking.items() if key.startswith("Leap status"))
assert leap.strip() == "Normal", leap
END
kill -INT "$both"
wait "$both" || fail "the receiver's exit code is $?"
grep -q "Could not\|rror" "$folder/chronyd.log" && fail "chronyd complains"
echo "chronyd takes the samples of both kinds and follows them"
