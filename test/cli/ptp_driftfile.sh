#!/bin/bash
# SPDX-License-Identifier: MIT
# What the servo learnt survives a restart and a kill; a driftfile that is broken, of another clock, too new or not
# writable costs one warning and never the run.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/common.sh"

port=$((20000 + 2 * ($$ % 6000)))
ptp() { exec "$ftcs" ptp -i lo --event-port $port --general-port $((port + 1)) "$@"; }
receive() {  # name of the log, driftfile, further flags
  local log=$folder/$1.log drift=$2
  shift 2
  ptp --logAnnounceInterval -2 --skew 50ppm --offset 1ms --driftfile "$drift" "$@" > "$log" 2>&1 &
}
rate() { grep -o '"rate_ppb": [-0-9.e]*' "$1" | cut -d' ' -f2; }

ptp --role time-transmitter --logSyncInterval -4 --logAnnounceInterval -2 --logMinDelayReqInterval -4 \
  > "$folder/transmitter.log" 2>&1 &
pids+=($!)

drift=$folder/drift
receive first "$drift" --duration 4; first=$!
receive killed "$folder/killed" --driftfile_interval 0; killed=$!
receive unwritable /proc/ftcs-drift --duration 4; unwritable=$!
pids+=($first $killed $unwritable)
wait $first || fail "first run: exit code $?"
grep -q "driftfile $drift: not there yet" "$folder/first.log" || fail "no word of a missing driftfile"
wait $unwritable || fail "a driftfile that cannot be written must not end the run"
[ "$(grep -c 'driftfile: cannot write /proc/ftcs-drift' "$folder/unwritable.log")" -eq 1 ] ||
  fail "one warning for a driftfile that cannot be written"
# Not in the middle of a write, whose file stays: it is stopped, looked at, and let go on for as long as one is there.
temporary() { find "$folder" -name 'drift.*' -o -name 'killed.?*' ! -name '*.log'; }
for _ in $(seq 100); do
  kill -STOP $killed
  # Every thread of it, out of every system call.
  while grep -h '^State:' /proc/$killed/task/*/status | grep -qv '[TZ] ('; do sleep 0.01; done
  [ -z "$(temporary)" ] && break
  kill -CONT $killed
  sleep 0.02
done
kill -KILL $killed
python3 -c '
import json, sys
for name in sys.argv[1:]:
    rate = json.load(open(name))["rate_ppb"]
    assert 40e3 < rate < 60e3, f"{name}: {rate} ppb of a clock that is 50 ppm fast"
' "$drift" "$folder/killed" || fail "the learnt rate"
[ -z "$(temporary)" ] || fail "temporary files are left"

# The same clock again; then files that must not be used.
head -c 60 "$drift" > "$folder/cut"
sed 's/"ftcs_state": 1/"ftcs_state": 99/' "$drift" > "$folder/future"
sed 's/interval/x/; s/"lo,/"eth7,/' "$drift" > "$folder/other"
receive again "$drift" --duration 4; again=$!
receive cut "$folder/cut" --duration 4; cut=$!
receive future "$folder/future" --duration 4; future=$!
receive other "$folder/other" --duration 4; other=$!
receive pi "$folder/pi" --servo linuxptp-pi --duration 2; pi=$!
for run in again cut future other; do wait "${!run}" || fail "$run: exit code $?"; done
wait $pi
grep -q "driftfile $drift: rate +[45]" "$folder/again.log" || fail "the state was not read"
grep -q "cut: not used, it is broken" "$folder/cut.log" || fail "a cut file"
grep -q "future: not used, it has format 99" "$folder/future.log" || fail "a file of a later program"
grep -q "other: not used, it is of another clock (eth7" "$folder/other.log" || fail "a file of another clock"
grep -q "the servo linuxptp-pi keeps no state" "$folder/pi.log" || fail "a servo without a state"
for kept in cut future other; do [ -n "$(rate "$folder/$kept")" ] || fail "$kept was not replaced by a good one"; done

"$ftcs" ptp -i lo --driftfile "$folder/none/drift" > "$folder/usage.log" 2>&1
[ $? -eq 2 ] || fail "a driftfile in a folder that does not exist is wrong usage"
grep -q "expected a file in a folder that exists" "$folder/usage.log" || fail "the error's text"
