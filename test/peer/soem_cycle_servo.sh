#!/bin/bash
# SPDX-License-Identifier: MIT
# The cycle servo in SOEM's loop (examples/soem_cycle.c, compiled against SOEM's headers and library) on our segment over veth,
# beside SOEM's own PI (its ec_sample as it is): time to lock and phase. One observer for both: the latches in the frames.
#
# SOEM_PATH=build folder of SOEM 2   test/peer/soem_cycle_servo.sh [build/ftcs [folder of libftcs_cycle_servo.a [seconds]]]
# Skipped (77) without it. SOEM is GPL: what is linked here with it is linked for this test and never given away.
# shellcheck source=test/peer/ethercat_common.sh
. "$(dirname "$0")/ethercat_common.sh"

ftcs=$(realpath "${1:-build/ftcs}")
libraries=$(realpath "${2:-build/layer/discipline}")
seconds=${3:-10}
[ -n "${SOEM_PATH:-}" ] || skip "SOEM_PATH names no build folder of SOEM"
sample=$SOEM_PATH/samples/ec_sample/ec_sample
source=$(sed -n 's/^SOEM_SOURCE_DIR:STATIC=//p' "$SOEM_PATH/CMakeCache.txt" 2> /dev/null)
for file in "$SOEM_PATH/libsoem.a" "$sample" "$source/include/soem/soem.h"; do
  [ -e "$file" ] || skip "there is no $file"
done
make_segment_network tshark "${CC:=cc}"
project=$(realpath "$here/../..")

"$CC" -std=c99 -Wall -Wextra -Werror -O2 -I"$project" -isystem "$source/include" -isystem "$SOEM_PATH/include" \
  -isystem "$source/osal" -isystem "$source/osal/linux" -isystem "$source/oshw/linux" "$project/examples/soem_cycle.c" \
  "$libraries/libftcs_cycle_servo.a" "$SOEM_PATH/libsoem.a" -lm -lpthread -lrt -o "$folder/soem_cycle" ||
  { fail "examples/soem_cycle.c does not compile against SOEM"; finish; }
echo "examples/soem_cycle.c compiles and links against SOEM"

measure() {  # name, seconds, program ...
  local name=$1 limit=$2
  shift 2
  # A segment just switched on: each program meets the same crystals, and any phase.
  start_segment "$ftcs" ethercat-segment -i ev1 --drives 8 --ppm=50,-80,80 --priority 70
  start_capture "$name"
  at_main "$limit" "$@" 2>&1 | tr '\r' '\n' > "$folder/$name.log"
  local result=${PIPESTATUS[0]}
  stop_capture
  echo "== $name"
  "$here/ethercat_capture.py" phase "$capture" 1000000 500000
  local observed=$?
  stop_segment
  [ "$observed" -ne 1 ] || fail "$name: no cyclic frames"
  return "$result"
}

# It has no end of its own before 100 s: interrupted. Its first second passes before it asks for OP.
measure ec_sample "$((seconds + 3))" "$sample" ev0 1000
grep -q "^EtherCAT OP" "$folder/ec_sample.log" && echo "ec_sample: OP"
# Drives that a stalled host starves of outputs fault, as they must: a run with such a stall says nothing of the servo.
busy=0
judge_failure() {  # name
  local stalled
  stalled=$(sed -n 's/.*, \([0-9]*\) passed over by stalls/\1/p' "$folder/$1.log")
  if [ "${stalled:-0}" -ge 4 ]; then
    echo "$1: not locked or not in OP; the host stood still for $stalled cycles: not judged"
    busy=1
  else
    fail "$1: not locked or not in OP"
  fi
}

ours() {  # law, start
  measure "$1, $2" "$((seconds + 20))" "$folder/soem_cycle" ev0 "$1" "$seconds" 1000 500 "$2" ||
    judge_failure "$1, $2"
  grep -v SCHED_FIFO "$folder/$1, $2.log"
  grep "^drive  0" "$folder/segment.log"
}
# Where the start may not jump, as with the PI, and as the servo starts if it may.
for law in ftcs pics adaptive; do ours "$law" slew; done
for law in ftcs adaptive; do ours "$law" align; done
check_capture adaptive
if [ "$failures" -eq 0 ] && [ $busy -ne 0 ]; then skip "the host was too busy to judge every run"; fi
finish
