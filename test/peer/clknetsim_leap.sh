#!/bin/bash
# SPDX-License-Identifier: MIT
# A day with a leap second inside clknetsim: ftcs phc keeps the system clock on UTC by a hardware clock that shows TAI.
# A second is inserted or left out at midnight, by the simulated kernel or (-x) by us.
#
# CLKNETSIM_PATH=folder with clknetsim and clknetsim.so   test/peer/clknetsim_leap.sh [build/ftcs]
# Skipped (77) without it. The program runs without the right to set clocks: it cannot touch this machine's.
set -euo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
# shellcheck source=test/peer/clknetsim_common.sh
source "$(dirname "$0")/clknetsim_common.sh"
command -v setpriv > /dev/null || skip "no setpriv to drop the right to set clocks"

failures=0
# 2016-12-31 00:00 as the simulator's start; the list counts from 1900.
start=1483142400
midnight=$((start + 86400 + 2208988800))

day() {  # TAI - UTC after midnight, more flags
  local after=$1
  shift
  printf '%s 36\n%s %s\n' $((midnight - 86400 * 500)) "$midnight" "$after" > "$folder/list"
  printf 'node1_offset = -36\nnode1_freq = 5e-6\nnode1_refclock = (* 100e-9 (normal))\n' > "$folder/conf"
  setpriv --bounding-set -sys_time --inh-caps -sys_time env CLKNETSIM_START_DATE=$start CLKNETSIM_RANDOM_SEED=1 \
    LD_PRELOAD="$CLKNETSIM_PATH/clknetsim.so" CLKNETSIM_NODE=1 CLKNETSIM_SOCKET="$folder/socket" \
    "$ftcs" phc --unconfined --allow-epoch --max-change 0 --max-total-change 0 -s /dev/ptp0 --leapfile "$folder/list" -R 0.25 -l 5 "$@" > "$folder/log" 2>&1 &
  local node=$!
  pids=("$node")
  CLKNETSIM_RANDOM_SEED=3 "$CLKNETSIM_PATH/clknetsim" -s "$folder/socket" -l 86600 -o "$folder/offsets" "$folder/conf" 1 \
    > "$folder/stats" 2> "$folder/simulator" || { cat "$folder/simulator" "$folder/log"; exit 1; }
  wait "$node" || failures=$((failures + 1))
  # The last 100 readings before 24:00:00 and after it (36 s of TAI later, and a little for our own leap).
  if ! awk -v after="$after" 'NR > 86300 && NR <= 86400 && ($1 + 36) ^ 2 > 1e-12 { bad = 1 }
      NR > 86450 && ($1 + after) ^ 2 > 1e-12 { bad = 1 } { last = $1 } END { print "  at the end", last, "s"; exit bad }' \
      "$folder/offsets"; then
    failures=$((failures + 1))
    echo "FAILED: TAI - UTC $after, $*:"
    cat "$folder/log"
  fi
  grep "leap second" "$folder/log" | sed 's/^/  /'
}

for after in 37 35; do
  for flags in "" -x; do
    echo "== TAI - UTC from 36 to $after s ${flags:+by us}"
    # shellcheck disable=SC2086
    day "$after" $flags
  done
done
exit "$failures"
