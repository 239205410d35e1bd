#!/bin/bash
# SPDX-License-Identifier: MIT
# SOEM's own programs (slaveinfo, simple_ng, ec_sample) bring our segment of eight drives to OP with distributed clocks; the
# delays that slaveinfo shows are those of the wiring; tshark decodes all frames.
#
# SOEM_PATH=build folder of SOEM 2   test/peer/soem_masters.sh [build/ftcs]
# Skipped (77) without it. SOEM is GPL and never part of this project: separate programs.
# shellcheck source=test/peer/ethercat_common.sh
. "$(dirname "$0")/ethercat_common.sh"

ftcs=$(realpath "${1:-build/ftcs}")
[ -n "${SOEM_PATH:-}" ] || skip "SOEM_PATH names no build folder of SOEM"
samples=$SOEM_PATH/samples
for sample in slaveinfo simple_ng ec_sample; do
  [ -x "$samples/$sample/$sample" ] || skip "$samples holds no $sample/$sample"
done
make_segment_network tshark
drives=8

delays() {  # wiring, ppm, largest deviation in ns, ftcs' flags ...
  local shape=$1 ppm=$2 most=$3
  start_segment "$ftcs" ethercat-segment -i ev1 --drives $drives --topology "$shape" --ppm="$ppm" --cable 70ns --hop 310ns \
    --priority 70
  start_capture "slaveinfo-$shape"
  at_main 60 "$samples/slaveinfo/slaveinfo" ev0 -map > "$folder/slaveinfo.log" 2>&1 || fail "slaveinfo: exit code $?"
  local expected shown
  expected=$("$here/wiring_delays.py" "$shape" $drives 70 310)
  shown=$(sed -n 's/^ Delay: \([0-9-]*\)\[ns\]/\1/p' "$folder/slaveinfo.log" | tr '\n' ' ')
  echo "slaveinfo, $shape, crystals $ppm ppm: delays $shown ns, wiring $expected ns"
  python3 - "$most" "$expected" "$shown" << 'PY' || fail "delays of the $shape"
import sys
most, expected, shown = int(sys.argv[1]), sys.argv[2].split(), sys.argv[3].split()
sys.exit(len(expected) != len(shown) or any(abs(int(a) - int(b)) > most for a, b in zip(expected, shown)))
PY
  [ "$(grep -c "Has DC: 1" "$folder/slaveinfo.log")" -eq $drives ] || fail "slaveinfo sees too few distributed clocks"
  grep -q "Calculated workcounter 24" "$folder/slaveinfo.log" || fail "slaveinfo expects another working counter"
  check_capture "slaveinfo-$shape"
  check_drives SAFEOP 0x0000 $drives
}
delays line 0 0
delays tree 0 0
# Crystals that differ: one tick of 10 ns of the clocks, and 160 ppm of a loop of 6 us.
delays line 50,-80,80 11
delays tree 50,-80,80 11

start_segment "$ftcs" ethercat-segment -i ev1 --drives $drives --priority 70
start_capture simple_ng
at_main 12 "$samples/simple_ng/simple_ng" ev0 2>&1 | tr '\r' '\n' > "$folder/simple_ng.log"
grep -q "all slaves are now operational" "$folder/simple_ng.log" || fail "simple_ng does not reach OP"
rounds=$(grep -c "^Iteration.*WKC" "$folder/simple_ng.log")
full=$(grep -c "^Iteration.*WKC 24 " "$folder/simple_ng.log")
echo "simple_ng: OP, working counter 24 in $full of $rounds rounds"
# One more or less: the program is interrupted, and a busy host may let one frame come too late (2 ms).
[ "$rounds" -gt 1000 ] && [ "$full" -ge $((rounds - 1 - rounds / 100)) ] || fail "simple_ng: working counter"
check_capture simple_ng
check_drives SAFEOP 0x001B $drives

start_segment "$ftcs" ethercat-segment -i ev1 --drives $drives --priority 70
start_capture ec_sample
at_main 12 "$samples/ec_sample/ec_sample" ev0 1000 2>&1 | tr '\r' '\n' > "$folder/ec_sample.log"
grep -q "^EtherCAT OP" "$folder/ec_sample.log" || fail "ec_sample does not reach OP"
rounds=$(grep -c "^Processdata cycle" "$folder/ec_sample.log")
full=$(grep -c "^Processdata cycle.*Wck *24," "$folder/ec_sample.log")
echo "ec_sample: OP, working counter 24 in $full of $rounds lines"
[ "$rounds" -gt 200 ] && [ "$full" -ge $((rounds - 1 - rounds / 100)) ] || fail "ec_sample: working counter"
check_capture ec_sample
check_drives SAFEOP 0x001B $drives
finish
