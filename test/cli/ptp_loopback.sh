#!/bin/bash
# SPDX-License-Identifier: MIT
# A time transmitter and time receivers as processes on loopback, unprivileged ports, no root: lock, output
# formats, exit codes, signals.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/common.sh"

# Always in the background: the process becomes the program, so that its pid takes the signals.
port=$((20000 + 2 * ($$ % 6000)))
ptp() { exec "$ftcs" ptp -i lo --event-port $port --general-port $((port + 1)) "$@"; }

ptp --role time-transmitter --logSyncInterval -4 --logAnnounceInterval -2 --logMinDelayReqInterval -4 \
  > "$folder/transmitter" 2>&1 &
transmitter=$!
pids+=("$transmitter")
receive=(--logAnnounceInterval -2 --duration 4)

# Several receivers at once: a machine's loopback has room for them.
ptp --offset 1ms --skew 50ppm --json "${receive[@]}" > "$folder/json" 2> "$folder/json.log" &
json=$!
ptp --offset -1ms --skew -50ppm --csv "${receive[@]}" > "$folder/csv" 2> "$folder/csv.log" &
csv=$!
ptp --offset 2s "${receive[@]}" > "$folder/far" 2> "$folder/far.errors" &
far=$!
ptp --offset 2s --first-step "${receive[@]}" > "$folder/step" 2>&1 &
step=$!
ptp --domainNumber 9 "${receive[@]}" > "$folder/alone" 2>&1 &
alone=$!
ptp --servo none --offset 1ms "${receive[@]}" > "$folder/none" 2>&1 &
none=$!
for setting in ingressLatency egressLatency delayAsymmetry; do
  ptp --free_running 1 --json "--$setting" -400000 "${receive[@]}" > "$folder/$setting" 2> /dev/null &
  corrections+=($!)
done
pids+=("${corrections[@]}")
ptp > "$folder/interrupted" 2>&1 &
interrupted=$!
# Whoever goes away, such as head, ends no clock; nor does a full disk, which is an error at the end.
ptp --json "${receive[@]}" 2> "$folder/reader.log" > >(head -n 2 > "$folder/reader") &
reader=$!
full=
if [ -w /dev/full ]; then
  ptp --csv "${receive[@]}" > /dev/full 2> "$folder/full.log" &
  full=$!
fi
ptp "${receive[@]}" > >(head -n 2 > "$folder/text") 2> "$folder/text.log" &
text=$!
pids+=($reader $text $full $json $csv $far $step $alone $none $interrupted)

wait $json || fail "--json: exit code $?, expected 0 (locked)"
wait $csv || fail "--csv: exit code $?, expected 0 (locked)"
wait $reader || fail "--json, whose reader went away: exit code $?, expected 0 (locked)"
wait $text || fail "a log whose reader went away: exit code $?, expected 0 (locked)"
[ "$(wc -l < "$folder/reader")" -eq 2 ] || fail "--json, whose reader went away: no lines"
for log in reader text; do
  [ "$(grep -c "standard output: nobody reads it any more" "$folder/$log.log")" -eq 1 ] || fail "$log: it is not said, once"
done
grep -q "summary: locked" "$folder/reader.log" || fail "--json, whose reader went away: no summary"
[ -z "$full" ] || { wait $full; [ $? -eq 1 ] && grep -q "standard output: No space left on device; samples are lost" "$folder/full.log"; } ||
  fail "--csv to a full disk: expected exit code 1 and one sentence"
wait $step || fail "--first-step: exit code $?, expected 0 (locked)"
wait $far; [ $? -eq 3 ] || fail "2 s away without --first-step: expected exit code 3 (not locked)"
grep -q "the offset is 2.000 s, more than 1 s: not followed, 1 in a row; .*(--offset, 37s if it shows TAI)" "$folder/far" || fail "no clear warning when 2 s away"
wait $alone; [ $? -eq 3 ] || fail "nobody transmits in domain 9: expected exit code 3"
grep -q "counted besides: wrong_domain [0-9]" "$folder/alone" || fail "messages of another domain are not reported"
wait $none; [ $? -eq 3 ] || fail "1 ms away and free running: expected exit code 3"
grep -q "1 steps" "$folder/step" || fail "--first-step: no step"

# Stamps of arrival 400 us too late, of departure too late, a way there 400 us shorter: what ptp4l makes of that.
wait "${corrections[@]}"
python3 - "$folder" << 'EOF' || fail "corrections of latency and asymmetry"
import json, statistics, sys
for name, offset_us, delay_us in (("ingressLatency", 200, 200), ("egressLatency", -200, 200), ("delayAsymmetry", 400, 0)):
    samples = [json.loads(line) for line in open(f"{sys.argv[1]}/{name}")]
    for field, expected in (("offset_ns", offset_us), ("path_delay_ns", delay_us)):
        median = statistics.median(s[field] for s in samples if s["offset_ns"] is not None) / 1e3
        assert abs(median - expected) < 100, f"{name}: {field} is {median} us, expected {expected}"
EOF

kill -INT $interrupted
wait $interrupted || fail "SIGINT while locked: exit code $?, expected 0"
grep -q "summary: locked" "$folder/interrupted" || fail "SIGINT: no summary"
kill -TERM $transmitter
wait $transmitter || fail "SIGTERM: the transmitter's exit code is $?, expected 0"
grep -q "summary: transmitting" "$folder/transmitter" || fail "SIGTERM: no summary"

# The first correction removes offset and skew in one interval: from 1 ms to what the stamps allow.
python3 - "$folder/json" "$folder/csv" << 'EOF' || fail "samples"
import csv, json, sys
samples = [json.loads(line) for line in open(sys.argv[1])]
rows = list(csv.DictReader(open(sys.argv[2])))
assert list(samples[0]) == list(rows[0]), "JSON and CSV fields differ"
for name, offsets, sign in (
    ("json", [s["offset_ns"] for s in samples if s["offset_ns"] is not None], 1),
    ("csv", [float(r["offset_ns"]) for r in rows if r["offset_ns"]], -1),
):
    # An answer to Delay_Req may correct the clock before the second Sync: then 1 ms is never perceived.
    assert -200e3 < sign * offsets[0] < 1.5e6, f"{name}: starts at {offsets[0]} ns"
    assert sorted(map(abs, offsets[1:6]))[2] < 200e3, f"{name}: not corrected: {offsets[:6]}"
assert samples[-1]["locked"] is True and samples[-1]["state"] == "locked"
EOF
echo "loopback: lock, formats, exit codes and signals are as documented"
