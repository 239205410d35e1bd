#!/bin/bash
# SPDX-License-Identifier: MIT
# What cannot be plant time is refused by one clear sentence: sources that are not there, that nobody set or whose epoch is arbitrary,
# a grandmaster that is not heard, clocks of 32 bits or none in the drives, bridge terminals that are none. Those of PTP need root for a
# network namespace, and are left out without it.
set -uo pipefail
# shellcheck source=test/cli/common.sh
. "$(dirname "$0")/common.sh"
here=$(dirname "$(realpath "$0")")
port=$((20000 + $$ % 12000))
number=0

segment() {  # its flags ...
  [ "${#pids[@]}" -eq 0 ] || { kill "${pids[-1]}"; wait "${pids[-1]}" 2> /dev/null; }
  "$ftcs" ethercat-segment --udp "$port" "$@" > "$folder/segment.log" 2>&1 &
  pids+=($!)
  sleep 0.3
}

refused() {  # exit code, words of the sentence, flags of ethercat run ...
  local code=$1 words=$2
  shift 2
  number=$((number + 1))
  local log=$folder/refused$number.log
  timeout 30 "${inside[@]}" "$ftcs" ethercat run --udp "127.0.0.1:$port" --drift-pulses 100 -q --no-motion --duration 1 "$@" > "$log" 2>&1
  local got=$?
  local sentence
  sentence=$(grep "ftcs ethercat:" "$log" | tail -n 1)
  echo "$*: $sentence"
  [ $got -eq "$code" ] || fail "$*: expected exit code $code, not $got"
  grep -qF -- "$words" <<< "$sentence" || fail "$*: expected '$words'"
  [ "$(grep -c "ftcs ethercat:" "$log")" -eq 1 ] || fail "$*: one sentence, no more"
}
inside=()

refused 2 "lead and external need --plant-time" --bus-mode lead
refused 1 "'gps' is neither" --plant-time gps
limit=$("$ftcs" ethercat run --udp "127.0.0.1:$port" --in-sync-limit 60% 2>&1 | head -n 1)
grep -q "'60%' is neither a time above zero" <<< "$limit" || fail "--in-sync-limit 60%: $limit"
refused 1 "'aux9' is none of aux0 to aux7" --plant-time aux9
refused 1 "on which interface?" --plant-time ptp
refused 1 "/dev/ptp99" --plant-time /dev/ptp99
refused 2 "'bridge:x' is not bridge or bridge:POSITION" --plant-time bridge:x
refused 2 "which a bridge terminal is not" --plant-time bridge --bus-mode external --bus-write read-time
python3 -c 'import time, sys; sys.exit(time.clock_gettime_ns(11) - time.time_ns() > 10**9)' 2> /dev/null &&
  refused 1 "CLOCK_TAI is not set" --plant-time tai
[ -e /sys/kernel/time/aux_clocks ] || refused 1 "CLOCK_AUX 0 cannot be read" --plant-time aux0

printf '%s\n' "[global]" "sa_file $folder/no-keys" "spp 1" "active_key_id 1" > "$folder/keys.conf"
refused 2 "sa_file $folder/no-keys: No such file" --plant-time ptp:lo --ptp-config "$folder/keys.conf"

segment --drives 2 --clock-bits 0
refused 1 "there is nothing to put on plant time" --plant-time realtime --bus-mode external --await-lock 3
segment --drives 2 --clock-bits 32
refused 1 "the reference clock has 32 bits only" --plant-time realtime --bus-mode external
segment --drives 2
refused 1 "no bridge terminal" --plant-time bridge --bus-mode external
refused 1 "SubDevice 1: SDO aborted (object 0x1C13:01" --plant-time bridge:1 --bus-mode external

if [ "$(id -u)" -eq 0 ] && command -v ip > /dev/null && ip netns add "ftcs-pe$$" 2> /dev/null; then
  space=ftcs-pe$$
  trap 'cleanup; ip netns del "$space"' EXIT
  inside=(ip netns exec "$space")
  ip -n "$space" link set lo up
  ip -n "$space" link add pt type veth peer name gm
  ip -n "$space" addr add 10.77.0.1/24 dev pt
  ip -n "$space" link set pt up
  ip -n "$space" link set gm up
  refused 3 "ptp:pt: not known after 4 s: " --plant-time ptp:pt --bus-mode external --await-lock 4
  printf '%s\n' "[security_association]" "spp 1" "1 SHA256 secret" > "$folder/keys"
  printf '%s\n' "[global]" "sa_file $folder/keys" "spp 1" "active_key_id 1" > "$folder/keys.conf"
  "${inside[@]}" "$here/../doctor/transmitter.py" gm > "$folder/stranger.log" 2>&1 &
  stranger=$!
  pids+=("$stranger")
  refused 3 "not authentic" --plant-time ptp:pt --ptp-config "$folder/keys.conf" --bus-mode external --await-lock 5
  kill "$stranger"
  "${inside[@]}" "$here/../doctor/transmitter.py" gm unicast_ip=10.77.0.1 \
    unicast="$(ip -n "$space" -br link show pt | grep -oE '([0-9a-f]{2}:){5}[0-9a-f]{2}')" > "$folder/unicast.log" 2>&1 &
  stranger=$!
  pids+=("$stranger")
  refused 3 "not locked" --plant-time ptp:pt --bus-mode external --await-lock 4
  kill "$stranger"
  "${inside[@]}" "$here/../doctor/transmitter.py" gm flags=0 ahead=-1700000000 > "$folder/transmitter.log" 2>&1 &
  pids+=($!)
  refused 3 "an arbitrary epoch is no plant time" --plant-time ptp:pt --bus-mode external --await-lock 20
fi
echo "ok"
