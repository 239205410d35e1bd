#!/bin/bash
# SPDX-License-Identifier: MIT
# Runs the unmodified program inside clknetsim (https://github.com/mlichvar/clknetsim): its time receiver follows
# ptp4l's time transmitter, with simulated hardware and with software timestamps, end to end and peer to peer.
#
# CLKNETSIM_PATH=folder with clknetsim and clknetsim.so   test/peer/clknetsim_ptp.sh [build/ftcs]
# Skipped (77) without it.
set -euo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
seconds=${SECONDS_SIMULATED:-300}

# shellcheck source=test/peer/clknetsim_common.sh
source "$(dirname "$0")/clknetsim_common.sh"
command -v ptp4l > /dev/null || skip "no ptp4l"

run() {  # kind of time stamping, delay mechanism
  local kind=$1 mechanism=$2 result
  # Node 2 starts 10 ms away, 20 ppm fast; every message takes 10 us and some exponentially distributed jitter.
  cat > "$folder/conf" << EOF
node2_offset = 0.01
node2_freq = 20e-6
node1_delay2 = (+ 10e-6 (* 1e-7 (exponential)))
node2_delay1 = (+ 10e-6 (* 1e-7 (exponential)))
EOF
  cat > "$folder/transmitter.conf" << EOF
[global]
free_running 1
logSyncInterval -3
logMinDelayReqInterval -3
delay_mechanism $mechanism
EOF
  pids=()
  start_node 1 ptp4l -f "$folder/transmitter.conf" -i eth0 -m -q
  start_node 2 "$ftcs" ptp -i eth0 --unconfined --unicast 192.168.123.1 --time_stamping "$kind" --delay_mechanism "$mechanism" --summary_interval -7
  "$CLKNETSIM_PATH/clknetsim" -s "$folder/sock" -l "$seconds" "$folder/conf" 2 \
    > "$folder/stats" 2> "$folder/log" || { cat "$folder/log" "$folder"/log.*; return 1; }
  wait "${pids[1]}" && result=0 || result=$?
  echo "== $kind time stamping, $mechanism: exit code $result"
  grep -v "master offset" "$folder/log.2" || true
  grep "master offset" "$folder/log.2" | tail -3
  [ "$result" -eq 0 ]
}

for mechanism in E2E P2P; do
  run software "$mechanism"
  run hardware "$mechanism"
done
