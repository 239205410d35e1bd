#!/bin/bash
# SPDX-License-Identifier: MIT
# A segment and a MainDevice as processes, UDP on loopback, no root: scan, OP, lock, figures, clear errors. Judges behaviour,
# not timing: the machine may be busy.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/common.sh"

port=$((20000 + 4 * ($$ % 3000)))
to=(--udp "127.0.0.1:$port")

"$ftcs" ethercat scan "${to[@]}" > "$folder/nobody" 2>&1
[ $? -eq 1 ] || fail "nobody there: expected exit code 1"
grep -q "no reply from 127.0.0.1:$port" "$folder/nobody" || fail "nobody there: no clear error"
"$ftcs" ethercat scan -i no-such-if > "$folder/interface" 2>&1
[ $? -eq 1 ] || fail "wrong interface: expected exit code 1"
"$ftcs" ethercat run --cycle 3x > "$folder/usage" 2>&1
[ $? -eq 2 ] || fail "wrong duration: expected exit code 2"

for number in "run --duration nan" "run --unlocked-limit nan" "run --bus-limit-ppm nan" "run --gains nan,1" "run --duration inf"; do
  "$ftcs" ethercat $number > "$folder/number" 2>&1
  [ $? -eq 2 ] || fail "$number: expected exit code 2"
done
"$ftcs" ethercat-segment --duration nan > "$folder/number" 2>&1
[ $? -eq 2 ] || fail "segment --duration nan: expected exit code 2"

"$ftcs" ethercat-segment --udp "$port" --drives 8 --priority 70 --json "$folder/segment.json" > "$folder/segment" 2>&1 &
segment=$!
pids+=("$segment")
sleep 0.5
"$ftcs" ethercat scan "${to[@]}" > "$folder/scan" 2>&1 || fail "scan"
[ "$(grep -c "modelled servo drive" "$folder/scan")" -eq 8 ] || fail "scan: expected eight drives"
grep -q "delay 24[0-9][0-9] ns" "$folder/scan" || fail "scan: the last of eight is 7 x 350 ns away"
"$ftcs" ethercat run "${to[@]}" --drives 9 > "$folder/fewer" 2>&1
[ $? -eq 1 ] || fail "fewer drives than expected: exit code 1"
grep -q "expected 9, found 8" "$folder/fewer" || fail "fewer drives: no clear error"
"$ftcs" ethercat run "${to[@]}" --cycle 100ms --sync1 2=100:0us > "$folder/sync1" 2>&1
[ $? -eq 2 ] && grep -q "drive 2: 100 cycles are longer than the 4.29 s" "$folder/sync1" || fail "SYNC1 beyond its register"
"$ftcs" ethercat run "${to[@]}" --drift-pulses 200 --sync0-shift 8=100us > "$folder/absent" 2>&1
[ $? -eq 1 ] && grep -q "of drive 8: there are drives 0 to 7" "$folder/absent" || fail "SYNC0 of a drive that is not there"

# 4 ms leave a busy machine time to answer; one that stands still for ten cycles is no failure of the program.
patient=(--lost-frame-limit 1000)
"$ftcs" ethercat run "${to[@]}" "${patient[@]}" --drives 8 --cycle 4ms --sync-interval 200ms --gate 1ms --duration 6 \
  --drift-pulses 500 --json "$folder/run.json" > "$folder/run" 2>&1
code=$?
[ $code -eq 0 ] || [ $code -eq 3 ] || fail "run: exit code $code"
grep -q '"op_cycle": [0-9]' "$folder/run.json" || fail "run: the drives did not reach OP"

# Records that cannot be written: known before the drives are touched, or said while they go on.
quick=("${patient[@]}" --drives 8 --cycle 4ms --sync-interval 200ms --gate 2ms)
short=(--drift-pulses 200 --duration 2)
"$ftcs" ethercat run "${to[@]}" "${quick[@]}" "${short[@]}" --csv "$folder/none/x.csv" > "$folder/csv" 2>&1
[ $? -eq 1 ] && grep -q "cannot write .*x.csv: No such file" "$folder/csv" || fail "CSV in a folder that is not there"
grep -q "scan" "$folder/csv" && fail "CSV in a folder that is not there: the drives were touched"
for flag in --json --html; do
  "$ftcs" ethercat run "${to[@]}" "${quick[@]}" "${short[@]}" $flag "$folder/none/x" > "$folder/unwritable" 2>&1
  [ $? -eq 1 ] && grep -q "cannot write .*none/x: No such file" "$folder/unwritable" || fail "$flag in a folder that is not there"
  grep -q "scan" "$folder/unwritable" && fail "$flag in a folder that is not there: the drives were touched"
done
"$ftcs" ethercat-segment --udp $((port + 2)) --duration 60 --json "$folder/none/x" > "$folder/unwritable" 2>&1
[ $? -eq 1 ] && grep -q "cannot write .*none/x: No such file" "$folder/unwritable" || fail "segment: JSON in a folder that is not there"
echo precious > "$folder/old.csv"
"$ftcs" ethercat run --udp "127.0.0.1:$((port + 2))" --csv "$folder/old.csv" > "$folder/unreached" 2>&1
[ $? -eq 1 ] && [ "$(cat "$folder/old.csv")" = precious ] || fail "a run that never began cost the record before"
"$ftcs" ethercat run "${to[@]}" "${quick[@]}" "${short[@]}" -q --csv "$folder/old.csv" > "$folder/recorded" 2>&1
head -n 1 "$folder/old.csv" | grep -q "^cycle,state," && [ "$(wc -l < "$folder/old.csv")" -gt 100 ] || fail "CSV: the record is not there"
mkdir "$folder/record"
mkfifo "$folder/record/pipe"
head -n 20 "$folder/record/pipe" > "$folder/lines" &
"$ftcs" ethercat run "${to[@]}" "${quick[@]}" "${short[@]}" -q --csv "$folder/record/pipe" --json "$folder/cut.json" > "$folder/cut" 2>&1
[ $? -eq 1 ] && grep -q "cannot write .*pipe: Broken pipe (the run went on without it)" "$folder/cut" || fail "CSV cut short"
[ "$(wc -l < "$folder/lines")" -eq 20 ] && grep -q '"cycles": [1-9]' "$folder/cut.json" || fail "CSV cut short: no figures"
# Neither a reader that goes away nor a full disk ends the drives.
"$ftcs" ethercat run "${to[@]}" "${quick[@]}" "${short[@]}" --json "$folder/head.json" 2> "$folder/head.log" | head -n 1 > "$folder/head"
code=${PIPESTATUS[0]}
[ "$code" -eq 0 ] || [ "$code" -eq 3 ] || fail "a reader that went away: exit code $code"
grep -q "standard output: nobody reads it any more; the run goes on" "$folder/head.log" || fail "a reader that went away is not told of"
python3 -c 'import json, sys; sys.exit(json.load(open(sys.argv[1]))["cycles"] < 400)' "$folder/head.json" || fail "a reader that went away: ended early"
"$ftcs" ethercat-segment --udp $((port + 2)) --duration 60 --clock-csv "$folder/none/x" > "$folder/unwritable" 2>&1
[ $? -eq 1 ] && grep -q "cannot write .*none/x: No such file" "$folder/unwritable" || fail "segment: record in a folder that is not there"
if [ -w /dev/full ]; then
  "$ftcs" ethercat-segment --udp $((port + 3)) --drives 2 --priority 0 --clock-csv /dev/full --json "$folder/full.json" > "$folder/full.out" 2>&1 &
  full=$!
  pids+=("$full")
  sleep 0.3
  "$ftcs" ethercat run --udp "127.0.0.1:$((port + 3))" --cycle 1ms --gate 1ms --priority 0 --drift-pulses 15000 --duration 2 -q \
    --lost-frame-limit 1000 > "$folder/on_full" 2>&1
  code=$?
  [ $code -eq 0 ] || [ $code -eq 3 ] || fail "a segment whose disk is full: exit code $code"
  kill -INT "$full"
  wait "$full"
  [ $? -eq 1 ] && grep -q "cannot write /dev/full: No space left on device; the segment goes on without it" "$folder/full.out" ||
    fail "a segment whose disk is full does not say so"
  grep -q '"sync0_events": [1-9]' "$folder/full.json" || fail "a segment whose disk is full ended"
  "$ftcs" ethercat run "${to[@]}" "${quick[@]}" "${short[@]}" > /dev/full 2> "$folder/full"
  [ $? -eq 1 ] && grep -q "cannot write" "$folder/full" || fail "standard output full"
  grep -q "standard output: No space left on device; the run goes on" "$folder/full" || fail "standard output full is not told of at once"
fi
timeout -s INT 2 "$ftcs" ethercat run "${to[@]}" "${quick[@]}" --drift-pulses 1000000 > "$folder/early" 2>&1
grep -q "stopped by a signal before the first cycle" "$folder/early" || fail "interrupted bring-up"
# A machine that stands still for longer than the drives' watchdog ends them before Ctrl-C does: again, then.
for _ in 1 2 3; do
  timeout --preserve-status -s INT 3 "$ftcs" ethercat run "${to[@]}" "${quick[@]}" --drift-pulses 200 --duration 0 > "$folder/interrupted" 2>&1
  code=$?
  [ $code -eq 0 ] || [ $code -eq 3 ] || fail "interrupted: exit code $code"
  grep -q "lost frames 0;" "$folder/interrupted" && break
done

# A reference that runs 5 % too fast from the seventh second on is beyond what the cycle may be bent: a defined end.
"$ftcs" ethercat-segment --udp $((port + 1)) --drives 2 --priority 70 --fault skew:0@5=50000 --duration 40 --sign-bit-behind > "$folder/skewed" 2>&1 &
skewed=$!
pids+=("$skewed")
sleep 0.3
"$ftcs" ethercat run --udp "127.0.0.1:$((port + 1))" --drives 2 --servo adaptive --cycle 4ms --gate 2ms --drift-pulses 200 -q \
  --unlocked-limit 1 --lost-frame-limit 1000 --duration 20 > "$folder/unlocked" 2>&1
code=$?
kill -INT "$skewed"
[ $code -eq 1 ] && grep -q "cycle out of sync with the reference" "$folder/unlocked" || fail "lost sync: exit code $code, expected 1"
kill -INT "$segment"
wait "$segment" || fail "segment: exit code $?, expected 0 after SIGINT"
grep -q '"sync0_events": [1-9]' "$folder/segment.json" || fail "segment: no SYNC0 in OP"
# Ctrl-C ended the last run, and the drives were told: none found out by its watchdog.
[ "$(grep -cE "^drive +[0-9]+ +SAFEOP +0x0000" "$folder/segment")" -eq 8 ] || fail "segment: not all drives in SAFEOP without an error"
echo "ok"
