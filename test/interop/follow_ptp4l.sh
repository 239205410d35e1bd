#!/bin/bash
# SPDX-License-Identifier: MIT
# Our time receiver follows Debian's ptp4l over veth: two-step, end-to-end, UDP/IPv4, software timestamps. Its
# virtual clock starts 1 ms away and 50 ppm fast.
#
# test/interop/follow_ptp4l.sh [build/ftcs] [SECONDS]
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
duration=${2:-12}
require ip ptp4l tshark
make_network
start_ptp4l transmitter "logSyncInterval -3" "logMinDelayReqInterval -3"
start_capture

code=0
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" -m -s --offset 1ms --skew 50ppm --time_stamping software \
  --tx_timestamp_timeout 50 --logAnnounceInterval -1 --summary_interval -7 --duration "$duration" \
  > "$folder/receiver.log" 2> "$folder/errors.log" || code=$?
grep -v "master offset" "$folder/receiver.log" || true
[ "$code" -eq 0 ] || fail "exit code $code: not locked"
[ -s "$folder/errors.log" ] && fail "error lines"
grep -qE "no transmit timestamp|FAULTY|no Sync" "$folder/receiver.log" && fail "fault lines"
grep -qE "LISTENING to UNCALIBRATED on RS_SLAVE" "$folder/receiver.log" || fail "no transmitter selected"

# Eight Syncs a second, less the start, which takes up to five seconds.
samples=$(grep -c "master offset" "$folder/receiver.log" || true)
[ "$samples" -ge $(((duration - 5) * 8 * 8 / 10)) ] || fail "only $samples samples in $duration s"
# Far above what a loaded machine does to software stamps, far below where the clock started.
median=$(sed -n 's/.*master offset *\(-\{0,1\}[0-9]*\) .*/\1/p' "$folder/receiver.log" \
  | tail -n $((samples / 2)) | tr -d - | sort -n | sed -n "$((samples / 4 + 1))p")
[ "$median" -lt 50000 ] || fail "the median offset is $median ns"
echo "$samples samples, median offset $median ns"
check_capture
