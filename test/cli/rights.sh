#!/bin/bash
# SPDX-License-Identifier: MIT
# What /proc says of running commands, against the table of docs/security.md: capabilities, no new privileges, a
# filter of system calls. Capabilities need root; without, there are none.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/common.sh"
table=$(dirname "$0")/../../docs/security.md
port=$((20000 + 4 * ($$ % 3000)))

declare -A bit=([CHOWN]=0 [DAC_OVERRIDE]=1 [NET_BIND_SERVICE]=10 [NET_ADMIN]=12 [NET_RAW]=13 [IPC_LOCK]=14 [SYS_NICE]=23 [SYS_TIME]=25)

expected() {  # the row's first column: CapEff, of those that we have ourselves
  local row names mask=0 name ours
  row=$(grep -F "| $1 |" "$table") || fail "no row '$1' in the table"
  names=$(cut -d'|' -f3 <<< "$row" | tr -d ' ')
  for name in ${names//,/ }; do
    [ "$name" = none ] || mask=$((mask | 1 << ${bit[$name]}))
  done
  ours=$((16#$(sed -n 's/^CapPrm:\t//p' /proc/self/status)))
  printf '%016x' $((mask & ours))
}

check() {  # ROW COMMAND...
  local row=$1 pid name
  shift
  "$ftcs" "$@" > "$folder/out" 2>&1 &
  pid=$!
  pids+=($pid)
  for _ in $(seq 50); do
    [ "$(sed -n 's/^Seccomp:\t//p' "/proc/$pid/status" 2> /dev/null)" = 2 ] && break
    sleep 0.1
  done
  [ -d "/proc/$pid" ] || fail "$row: it has ended"
  for name in "CapEff:$(expected "$row")" "CapPrm:$(expected "$row")" NoNewPrivs:1 Seccomp:2; do
    [ "$(sed -n "s/^${name%%:*}:\t//p" "/proc/$pid/status")" = "${name#*:}" ] ||
      fail "$row: expected $name, found $(grep "^${name%%:*}:" "/proc/$pid/status")"
  done
  echo "ok: $row"
}

udp=(--event-port $port --general-port $((port + 1)) --uds_address none)
check '`ftcs ptp -S` with ports above 1023' ptp -i lo -S "${udp[@]}"
check '`ftcs ethercat-segment`' ethercat-segment --udp $((port + 2)) --drives 2
check '`ftcs ethercat run`' ethercat run --udp "127.0.0.1:$((port + 2))" --duration 0 --quiet
if [ "$(id -u)" -eq 0 ]; then
  check '`ftcs ptp -S`' ptp -i lo -S --uds_address none
  check '`ftcs ptp`' ptp -i lo --uds_address none
  check '`ftcs ptp --role time-transmitter -S`' ptp -i lo --role time-transmitter -S --uds_address none
  check '`ftcs ptp -S -2`' ptp -i lo -S -2 --uds_address none

  "$ftcs" ptp -i lo -S --uds_address none --user nobody > "$folder/user" 2>&1 &
  pid=$!
  pids+=($pid)
  for _ in $(seq 50); do
    [ "$(stat -c %U "/proc/$pid" 2> /dev/null)" = nobody ] && break
    sleep 0.1
  done
  grep -q "^Uid:.*$(id -u nobody)" "/proc/$pid/status" || fail "--user nobody: it is somebody else"
  [ "$(sed -n 's/^CapEff:\t//p' "/proc/$pid/status")" = 0000000000000400 ] || fail "--user nobody: capabilities"
fi
"$ftcs" ptp -i lo --user no-such-user > "$folder/nobody" 2>&1 && fail "--user: an unknown user is no error"
grep -q "no such user" "$folder/nobody" || fail "--user: no clear error"
echo "rights are those of the table"
