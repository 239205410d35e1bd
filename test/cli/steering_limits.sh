#!/bin/bash
# SPDX-License-Identifier: MIT
# What the steered clock bears is kept to: rates change by no more at a time than --max-frequency-change, are
# multiples of --frequency-granularity, and time never jumps. Peer to peer on loopback, so that each command is
# one line of the CSV output.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/common.sh"

# Always in the background: the process becomes the program, so that its pid takes the signals. Each receiver
# has a transmitter of its own: a link has two ends.
first=$((20000 + 4 * ($$ % 3000)))
ptp() {
  local port=$1
  shift
  exec "$ftcs" ptp -i lo --event-port "$port" --general-port $((port + 1)) -P --logMinPdelayReqInterval -3 "$@"
}
for port in $first $((first + 2)); do
  ptp "$port" --role time-transmitter --logSyncInterval -4 --logAnnounceInterval -2 > "$folder/transmitter$port" 2>&1 &
  pids+=($!)
done
receive=(--skew 50ppm --csv --logAnnounceInterval -2 --duration 5)
ptp "$first" "${receive[@]}" > "$folder/free.csv" 2> "$folder/free.log" &
free=$!
cat > "$folder/ptp.conf" << 'EOT'
[global]
max_frequency_change 8000
never_step 1
EOT
ptp $((first + 2)) -f "$folder/ptp.conf" --frequency-granularity 10ppb "${receive[@]}" \
  > "$folder/limited.csv" 2> "$folder/limited.log" &
limited=$!
pids+=($free $limited)
# Locked or not: a busy machine may be too noisy for that, and is no excuse for a rate.
for pid in $free $limited; do
  wait "$pid"
  code=$?
  [ $code -eq 0 ] || [ $code -eq 3 ] || fail "exit code $code, expected 0 or 3"
done

python3 - "$folder/free.csv" "$folder/limited.csv" << 'EOF' || fail "rates"
import csv, sys

def commands(path):
    return [
        (float(row["applied_rate_ppb"]), float(row["tracking_rate_ppb"]), float(row["step_ns"]))
        for row in csv.DictReader(open(path))
        if row["verdict"] in ("used", "rejected") and float(row["tracking_rate_ppb"]) != 0.0
    ]

def largest_change(commands):
    largest, before = 0.0, (0.0, 0.0)
    for applied, tracking, _ in commands:
        # The correction before may have been over or not: which of its rates held, the line does not say.
        start = min(abs(applied - rate) for rate in before)
        largest = max(largest, start, abs(tracking - applied))
        before = (applied, tracking)
    return largest

free, limited = (commands(path) for path in sys.argv[1:])
assert len(limited) > 40, f"{len(limited)} commands"
assert largest_change(free) > 20e3, f"without a limit {largest_change(free)} ppb: this test shows nothing"
assert largest_change(limited) <= 8e3 + 1e-3, f"changed by {largest_change(limited)} ppb at a time"
assert min(tracking for _, tracking, _ in limited) < -40e3, "did not get there"
assert all(step == 0.0 for _, _, step in limited), "stepped"
off = max(abs(rate / 10 - round(rate / 10)) for command in limited[-20:] for rate in command[:2])
assert off < 1e-3, f"a rate {off} units beside the granularity"
EOF
echo "the limits of the steered clock are kept to"
