#!/bin/bash
# SPDX-License-Identifier: MIT
# ingressLatency, egressLatency and delayAsymmetry mean to the nanosecond what they mean to ptp4l: both look, steering
# nothing, at the same transmitter inside clknetsim (https://github.com/mlichvar/clknetsim), end to end and peer to peer.
#
# CLKNETSIM_PATH=folder with clknetsim and clknetsim.so   test/peer/clknetsim_corrections.sh [build/ftcs]
# Skipped (77) without it.
set -euo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
# shellcheck source=test/peer/clknetsim_common.sh
source "$(dirname "$0")/clknetsim_common.sh"
command -v ptp4l > /dev/null || skip "no ptp4l"
printf 'node1_delay2 = (+ 10e-6 0)\nnode2_delay1 = (+ 10e-6 0)\n' > "$folder/conf"

seen() {  # program and its arguments: the last offset and path delay in its log
  pids=()
  start_node 1 ptp4l -f "$folder/common.conf" -i eth0 -m -q
  start_node 2 "$@" -f "$folder/common.conf" -i eth0 -m -q --slaveOnly 1
  "$CLKNETSIM_PATH/clknetsim" -s "$folder/sock" -l 60 "$folder/conf" 2 > /dev/null 2>&1
  wait "${pids[1]}" || true  # nothing is steered: not locked
  sed -n 's/.*master offset *\(-\{0,1\}[0-9]*\) .*path delay *\([0-9]*\).*/\1 \2/p' "$folder/log.2" | tail -n 1
}

failures=0
for mechanism in E2E P2P; do
  printf '%s\n' "[global]" "free_running 1" "logSyncInterval -3" "logMinDelayReqInterval -3" "logMinPdelayReqInterval -3" \
    "summary_interval -4" "delay_mechanism $mechanism" > "$folder/common.conf"
  for setting in "ingressLatency 500" "egressLatency 300" "delayAsymmetry 200" "delayAsymmetry -200"; do
    read -r name value <<< "$setting"
    theirs=$(seen ptp4l "--$name" "$value")
    ours=$(seen "$ftcs" ptp --unconfined --unicast 192.168.123.1 --allow-epoch --max-change 0 --max-total-change 0 --clock phc "--$name" "$value")
    echo "$mechanism, $setting: offset and path delay $theirs with ptp4l, $ours here"
    read -r a b c d <<< "$theirs $ours"
    if [ -z "$d" ] || [ $((a - c)) -gt 2 ] || [ $((c - a)) -gt 2 ] || [ $((b - d)) -gt 2 ] || [ $((d - b)) -gt 2 ]; then
      failures=$((failures + 1))
    fi
  done
done
exit "$failures"
