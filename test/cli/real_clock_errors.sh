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

expect 1 "steering CLOCK_REALTIME (CAP_SYS_TIME): not permitted" ptp -i lo --clock system
expect 1 "steering CLOCK_REALTIME (CAP_SYS_TIME): not permitted" ptp -i lo --clock auto
expect 1 "interface nosuch0: no such device" ptp -i nosuch0 --clock auto
expect 1 "hardware time stamping on lo" ptp -i lo --clock phc
expect 1 "hardware time stamping on lo" ptp -i lo -p /dev/ptp0
expect 1 "hardware timestamps are of the adapter's clock" ptp -i lo -H --clock system
expect 1 "software timestamps (-S) are of the system clock" ptp -i lo -S --clock phc
expect 1 "$folder/none.list: No such file" ptp -i lo --clock system --leapfile "$folder/none.list"
printf '3550089600 35\n3550089600 36\n' > "$folder/wrong.list"
expect 1 "$folder/wrong.list:2: not later than the line before" ptp -i lo --clock system --leapfile "$folder/wrong.list"

expect 2 "no source: give one with -s" phc
expect 2 "the time offset must be given: -O SECONDS (steered clock minus source), --leapfile FILE, or -w" phc -s /dev/ptp0
expect 1 "/dev/no-ptp: no such device" phc -s /dev/no-ptp -c CLOCK_REALTIME --step_threshold=1 --transportSpecific=1 -w -m
expect 1 "/dev/no-ptp: no such device" phc -s /dev/no-ptp -c CLOCK_REALTIME -O 0 -w -m
expect 2 "unknown option '--step_treshold'; did you mean '--step_threshold'?" phc -s /dev/ptp0 -O 0 --step_treshold=1
expect 2 "-r is of -a" phc -r
expect 2 "-a needs -r" phc -a
expect 2 "-a finds the clocks itself" phc -a -r -s eth0
expect 2 "-a and -O exclude each other" phc -a -r -O 0
expect 2 "-O and --leapfile exclude each other" phc -s /dev/ptp0 -O 0 --leapfile x
expect 2 "only where CLOCK_REALTIME is steered" phc -s CLOCK_REALTIME -c eth0 --leapfile x
expect 2 "'linreg' is not supported" phc -s /dev/ptp0 -O 0 -E linreg
expect 2 "-P and -I are of the pi servo" phc -s /dev/ptp0 -O 0 -P 1
expect 2 "--max-frequency: 0.5 ppb: expected 1 to 9e+08 ppb" phc -s /dev/ptp0 -O 0 --max-frequency 0.5ppb
expect 2 "--steering-latency: '5' is no time" phc -s /dev/ptp0 -O 0 --steering-latency 5
expect 2 "frequency_granularity: the servo linuxptp-pi cannot keep to it" phc -s /dev/ptp0 -O 0 -E pi --frequency-granularity 1ppb
expect 2 "not finer than max_frequency_change" phc -s /dev/ptp0 -O 0 --max-frequency-change 1ppb --frequency-granularity 1ppb
expect 2 "--never-step excludes -F and -S" phc -s /dev/ptp0 -O 0 --never-step -F 0.001
expect 2 "unknown servo 'magic'" phc -s /dev/ptp0 -O 0 --servo magic
expect 2 "a PPS source is not supported" phc -d /dev/pps0
expect 2 "-R: '0': expected a number" phc -R 0
expect 2 "-N: '26': expected an integer from 1 to 25" phc -N 26
expect 2 "-O: '0.5': expected an integer" phc -s /dev/ptp0 -O 0.5
expect 1 "/dev/no-ptp: no such device" phc -s /dev/no-ptp -O 0
# ptp4l's file: flags win wherever they stand, and what is wrong in it is named.
printf '[global]\ndomainNumber 24\nclock_servo pi\nfirst_step_threshold 1\ntransportSpecific 0x1\n' > "$folder/ptp.conf"
expect 2 "-f: $folder/none.conf: No such file" phc -f "$folder/none.conf" -a -r
expect 2 "steering_latency: the servo linuxptp-pi cannot keep to it" phc -s /dev/no-ptp -O 0 --steering-latency 1us -f "$folder/ptp.conf"
expect 1 "/dev/no-ptp: no such device" phc -s /dev/no-ptp -O 0 --steering-latency 1us --servo adaptive -f "$folder/ptp.conf"
for domain in 24 7; do
  flags=(-f "$folder/ptp.conf" --duration 0.1)
  [ "$domain" -eq 24 ] || flags=(-n "$domain" "${flags[@]}")
  without_right "$ftcs" phc -a -r "${flags[@]}" > "$folder/out" 2>&1
  grep -qF "domain $domain, transportSpecific 1" "$folder/out" && continue
  echo "FAILED: phc -a -r ${flags[*]} with domain 24 in the file says:"
  cat "$folder/out"
  failures=$((failures + 1))
done
echo "colour blue" >> "$folder/ptp.conf"
expect 2 "-f: $folder/ptp.conf:6: unknown setting 'colour'" phc -f "$folder/ptp.conf" -a -r
expect 1 "/dev/null: not a PTP hardware clock" phc -s /dev/null -O 0
expect 1 "interface nosuch0: no such device" phc -s nosuch0 -O -37
expect 1 "interface lo: no PTP hardware clock: Operation not supported" phc -s lo -O -37
expect 1 "steering CLOCK_REALTIME (CAP_SYS_TIME): not permitted" phc -s CLOCK_REALTIME -O 0

[ "$failures" -eq 0 ] && echo "all errors are as documented"
exit "$failures"
