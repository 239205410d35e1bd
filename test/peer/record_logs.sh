#!/bin/bash
# SPDX-License-Identifier: MIT
# Records logs of the unmodified programs of Debian (ptp4l, phc2sys, chronyd) inside clknetsim
# (https://github.com/mlichvar/clknetsim), start-up included: a clock 500 us away, 20 ppm fast. Then each goes
# through `ftcs compare --log`. With a folder the logs are kept there: test/data/logs was made so.
#
# CLKNETSIM_PATH=folder with clknetsim and clknetsim.so   test/peer/record_logs.sh [build/ftcs] [FOLDER]
# Skipped (77) without it, or without a program.
set -euo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
keep=${2:+$(realpath "$2")}

# shellcheck source=test/peer/clknetsim_common.sh
source "$(dirname "$0")/clknetsim_common.sh"
for program in ptp4l phc2sys chronyd; do command -v "$program" > /dev/null || skip "no $program"; done
cd "$folder"

simulate() {  # seconds, nodes
  "$CLKNETSIM_PATH/clknetsim" -s "$folder/sock" -l "$1" "$folder/conf" "$2" > stats 2> simulator ||
    { cat simulator log.*; exit 1; }
  wait "${pids[@]}" || true
  pids=()
}

cat > conf << 'EOF'
node2_offset = 0.0005
node2_freq = 20e-6
node1_delay2 = (+ 10e-6 (* 1e-7 (normal)))
node2_delay1 = (+ 10e-6 (* 1e-7 (normal)))
EOF
printf '[global]\nfree_running 1\n' > transmitter.conf
printf '[global]\nslaveOnly 1\n' > receiver.conf
start_node 1 ptp4l -f transmitter.conf -i eth0 -m -q
start_node 2 ptp4l -f receiver.conf -S -i eth0 -m -q
simulate 100 2
mv log.2 ptp4l-startup.log

printf '[global]\nfree_running 1\nlogSyncInterval -3\n' > transmitter.conf
printf '[global]\nslaveOnly 1\nlogSyncInterval -3\nsummary_interval 1\n' > receiver.conf
start_node 1 ptp4l -f transmitter.conf -i eth0 -m -q
start_node 2 ptp4l -f receiver.conf -S -i eth0 -m -q
simulate 100 2
mv log.2 ptp4l-summaries.log

# Slew at 10 ppm at most: a minute in which most of the offset is still to be removed. Addresses of clknetsim.
printf 'pidfile 1.pid\nlocal stratum 1\nallow\ncmdport 0\nbindcmdaddress /\n' > server.conf
printf '%s\n' "pidfile 2.pid" "server 192.168.123.1 minpoll 2 maxpoll 2 xleave iburst" "maxslewrate 10" \
  "logdir ." "log measurements tracking" "cmdport 0" "bindcmdaddress /" > client.conf
start_node 1 chronyd -d -u root -f server.conf
start_node 2 chronyd -d -u root -f client.conf
simulate 260 2
mv tracking.log chrony-tracking.log
mv measurements.log chrony-measurements.log

printf 'node1_offset = 0.0005\nnode1_freq = 20e-6\nnode1_refclock = (* 1e-7 (normal))\n' > conf
start_node 1 phc2sys -s /dev/ptp0 -c CLOCK_REALTIME -O 0 -m -q
simulate 60 1
mv log.1 phc2sys-startup.log

for log in ptp4l-startup ptp4l-summaries phc2sys-startup chrony-tracking chrony-measurements; do
  "$ftcs" compare --log $log.log > out || { cat $log.log; echo "FAILED: ftcs compare --log $log.log"; exit 1; }
  grep -q "^adaptive" out || { cat out; echo "FAILED: no row for adaptive"; exit 1; }
  head -2 out
  [ -z "$keep" ] || cp $log.log "$keep"
done
