#!/bin/bash
# SPDX-License-Identifier: MIT
# A log that Debian's ptp4l (free_running) really wrote while it listened to our time transmitter over veth goes
# through `ftcs compare --log`: every servo has its row, and the report says that the log is free-running.
#
# test/interop/ptp4l_log.sh [build/ftcs] [SECONDS] [FILE]   with FILE: the log is kept there, and holds summaries (rms, max) in the
# place of offsets; test/data/logs/ptp4l-summaries-free.log was made so, in 75 s
. "$(dirname "$0")/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
duration=${2:-20}
require ip ptp4l python3
make_network
keep=${3:-} summary=-2
[ -z "$keep" ] || summary=0
start_ptp4l receiver "slaveOnly 1" "logSyncInterval -2" "freq_est_interval 0" "summary_interval $summary"
ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" --role time-transmitter --skew 5ppm --time_stamping software \
  --tx_timestamp_timeout 50 --logAnnounceInterval -1 --logSyncInterval -2 --logMinDelayReqInterval -2 \
  --duration "$duration" > "$folder/transmitter.log" || fail "the transmitter failed"
if [ -n "$keep" ]; then
  cp "$folder/receiver.log" "$keep"
  "$ftcs" compare --log "$keep"
  exit
fi
lines=$(grep -c "master offset" "$folder/receiver.log" || true)
[ "$lines" -ge $(((duration - 6) * 8 / 10)) ] || fail "ptp4l printed only $lines offsets"

"$ftcs" compare --log "$folder/receiver.log" --json "$folder/compare.json" > "$folder/compare.log" ||
  fail "ftcs compare --log"
cat "$folder/compare.log"
grep -qi "free.running" "$folder/compare.log" || fail "the report does not say that the log is free-running"
gzip -k "$folder/receiver.log"
"$ftcs" compare --log "$folder/receiver.log.gz" > "$folder/gzip.log" || fail "the same log, compressed"
python3 -c '
import json, sys
text = json.dumps(json.load(open(sys.argv[1])))
missing = [name for name in ("ftcs", "adaptive", "linuxptp-pi", "regression") if name not in text]
sys.exit("no row for " + ", ".join(missing) if missing else 0)' "$folder/compare.json" || fail "rows"
