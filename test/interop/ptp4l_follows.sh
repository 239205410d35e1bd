#!/bin/bash
# SPDX-License-Identifier: MIT
# Debian's ptp4l (free_running, so it steers nothing) takes our time transmitter's messages over veth: an offset
# each interval, no fault, and the rate error that our clock was given.
#
# test/interop/ptp4l_follows.sh [build/ftcs] [SECONDS] [UDPv4|UDPv6|L2] [E2E|P2P|hybrid|gptp]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
duration=${2:-12}
transport=${3:-UDPv4}
mechanism=${4:-E2E}
skew_ppb=5000
require ip ptp4l tshark dumpcap python3
make_network
choose_profile "$transport" "$mechanism"
# A free-running ptp4l prints once per freq_est_interval, which cannot be shorter than a second.
start_ptp4l receiver "slaveOnly 1" "logSyncInterval -2" "freq_est_interval 0" "summary_interval -2" \
  "${theirs_too[@]}"
start_capture

# The kernel's own correction of CLOCK_REALTIME, ptp4l's clock, against ours, four times a second: seconds and nanoseconds.
python3 -c '
import time
base = time.time_ns() - time.clock_gettime_ns(time.CLOCK_MONOTONIC_RAW)
while True:
    raw, real = time.clock_gettime_ns(time.CLOCK_MONOTONIC_RAW), time.clock_gettime_ns(time.CLOCK_REALTIME)
    print(f"{raw / 1e9:.9f} {real - raw - base}", flush=True)
    time.sleep(0.25)' > "$folder/clocks" &
clocks=$!
pids+=("$clocks")
code=0
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" --role time-transmitter --skew ${skew_ppb}ppb \
  --time_stamping software --tx_timestamp_timeout 50 --logMinDelayReqInterval -2 "${ours_too[@]}" \
  --logSyncInterval -2 --duration "$duration" > "$folder/transmitter.log" 2> "$folder/errors.log" || code=$?
kill "$clocks"
cat "$folder/transmitter.log"
[ "$code" -eq 0 ] || fail "exit code $code"
[ -s "$folder/errors.log" ] && fail "error lines"
grep -qE "no transmit timestamp|FAULTY" "$folder/transmitter.log" && fail "fault lines"
grep -qE "FAULT|timed out|bad message|ignoring" "$folder/receiver.log" && fail "ptp4l reports a fault"

samples=$(grep -c "master offset" "$folder/receiver.log" || true)
[ "$samples" -ge $(((duration - 6) * 8 / 10)) ] || fail "ptp4l printed only $samples offsets in $duration s"

# The median slope between two points: neither a delayed packet nor a step of CLOCK_REALTIME tilts it.
median_slope() {
  awk '{ for (i = 0; i < NR - 1; i++) if ($1 > x[i]) printf "%.3f\n", ($2 - y[i]) / ($1 - x[i])
         x[NR - 1] = $1; y[NR - 1] = $2 }' | sort -g > "$folder/slopes"
  sed -n "$(($(wc -l < "$folder/slopes") / 2 + 1))p" "$folder/slopes"
}
slope=$(sed -n 's/^ptp4l\[\([0-9.]*\)\]: master offset *\(-\{0,1\}[0-9]*\) .*/\1 \2/p' "$folder/receiver.log" | median_slope)
correction=$(median_slope < "$folder/clocks")
awk -v slope="$slope" -v correction="$correction" -v skew=$skew_ppb -v samples="$samples" 'BEGIN {
    expected = correction - skew
    printf "%d offsets; slope %.0f ppb, expected %.0f ppb\n", samples, slope, expected
    tolerance = 2000  # offsets scatter by microseconds over seconds
    exit !(slope - expected < tolerance && expected - slope < tolerance)
  }' || fail "ptp4l sees another rate than our clock has"
check_capture
