#!/bin/bash
# SPDX-License-Identifier: MIT
# What cannot be steered is refused in one line. Every run here lacks the right to set a clock (CAP_SYS_TIME is
# dropped), so that no mistake of ours can touch the clocks of the machine that runs the tests.
set -uo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
command -v setpriv > /dev/null || { echo "skipped: no setpriv to drop the right to set clocks"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failures=0

without_right() { setpriv --bounding-set -sys_time --inh-caps -sys_time --ambient-caps -sys_time -- "$@"; }
if without_right grep -qiE '^Cap(Eff|Prm).*[0-9a-f]{9}[2367abef][0-9a-f]{6}$' /proc/self/status; then
  echo "skipped: the right to set clocks cannot be dropped here"
  exit 77
fi

expect() {  # exit code, text that the one line must hold, arguments...
  local code=$1 text=$2 result
  shift 2
  without_right timeout 20 "$ftcs" "$@" > "$folder/out" 2> "$folder/err"
  result=$?
  if [ "$result" -ne "$code" ] || [ "$(wc -l < "$folder/err")" -ne 1 ] || ! grep -qF -- "$text" "$folder/err"; then
    echo "FAILED: ftcs $*: exit code $result, expected $code and one line with '$text'; got:"
    cat "$folder/err"
    failures=$((failures + 1))
  fi
}

expect 1 "steering CLOCK_REALTIME: not permitted" ptp -i lo --clock system
expect 1 "steering CLOCK_REALTIME: not permitted" ptp -i lo --clock auto
expect 1 "interface nosuch0: no such device" ptp -i nosuch0 --clock auto
expect 1 "hardware time stamping on lo" ptp -i lo --clock phc
expect 1 "hardware time stamping on lo" ptp -i lo -p /dev/ptp0
expect 1 "hardware timestamps are of the adapter's clock" ptp -i lo -H --clock system
expect 1 "software timestamps (-S) are of the system clock" ptp -i lo -S --clock phc
expect 1 "$folder/none.list: No such file" ptp -i lo --clock system --leapfile "$folder/none.list"
printf '3550089600 35\n3550089600 36\n' > "$folder/wrong.list"
expect 1 "$folder/wrong.list:2: not later than the line before" ptp -i lo --clock system --leapfile "$folder/wrong.list"

[ "$failures" -eq 0 ] && echo "all errors are as documented"
exit "$failures"
