#!/bin/bash
# SPDX-License-Identifier: MIT
# KickCAT at both ends. Its simulator's eight CiA 402 drives: our MainDevice scans them, with the delays that it emulates (300 ns
# a hop), and brings them to OP. Its master (ds402_sinus) moves a drive of our segment, and runs all eight with SYNC0 and its own
# soft PLL (kickcat_dc.cpp, compiled against KickCAT). tshark decodes all frames.
#
# KICKCAT_PATH=build folder of KickCAT [KICKCAT_DRIVE=configuration of a simulated drive]   test/peer/kickcat_drives.sh [build/ftcs]
# Skipped (77) without it. KickCAT is never part of this project; what is compiled here against it is gone after the test.
# shellcheck source=test/peer/ethercat_common.sh
. "$(dirname "$0")/ethercat_common.sh"

ftcs=$(realpath "${1:-build/ftcs}")
[ -n "${KICKCAT_PATH:-}" ] || skip "KICKCAT_PATH names no build folder of KickCAT"
simulator=$KICKCAT_PATH/simulation/network_simulator
sinus=$KICKCAT_PATH/examples/master/ds402_drive/ds402_sinus
drive=${KICKCAT_DRIVE:-$KICKCAT_PATH/../simulation/slave_configs/ecat402-drive.json}
for file in "$simulator" "$sinus" "$drive"; do [ -e "$file" ] || skip "there is no $file"; done
make_segment_network tshark chrt

start_segment chrt -f 70 "$simulator" -i ev1 -s "$drive" "$drive" "$drive" "$drive" "$drive" "$drive" "$drive" "$drive"
start_capture scan
at_main 20 "$ftcs" ethercat scan -i ev0 --drives 8 > "$folder/scan.log" 2>&1 || fail "scan: exit code $?"
delays=$(grep -oE "delay [0-9]+ ns" "$folder/scan.log" | grep -oE "[0-9]+" | tr '\n' ' ')
echo "ftcs ethercat scan, KickCAT's drives: delays $delays ns"
[ "$delays" = "$("$here/wiring_delays.py" line 8 0 300) " ] || { cat "$folder/scan.log"; fail "delays are not 300 ns a hop"; }
check_capture scan

# Its clocks are read by the process, not at the wire: tens of microseconds of noise, hence the wide band.
start_capture run
at_main 40 "$ftcs" ethercat run -i ev0 --drives 8 --duration 8 --servo adaptive --lock-band 50us -q \
  --json "$folder/run.json" > "$folder/run.log" 2>&1 || { cat "$folder/run.log"; fail "run: exit code $?"; }
python3 - "$folder/run.json" << 'PY' || fail "our MainDevice with KickCAT's drives"
import json, sys
run = json.load(open(sys.argv[1]))
drives = run["drives"]
print(f"ftcs ethercat run, KickCAT's drives: locked in cycle {run['lock_cycle']}, OP in cycle {run['op_cycle']}, working counter "
      f"right in {run['working_counter_right']} of {run['cycles']} cycles, {run['lost_frames']} frames lost, |phase| p50 "
      f"{run['virtual_phase']['p50_ns'] / 1000:.1f} us, delays {[drive['propagation_delay_ns'] for drive in drives]} ns, "
      f"states {sorted({drive['state'] for drive in drives})}")
wrong = run["op_cycle"] < 0 or run["working_counter_right"] + run["lost_frames"] < run["cycles"]
wrong |= [drive["propagation_delay_ns"] for drive in drives] != [300 * n for n in range(8)]
wrong |= any(drive["state"] != "OP" for drive in drives)
sys.exit(wrong)
PY
check_capture run
stop_segment

start_segment "$ftcs" ethercat-segment -i ev1 --drives 8 --priority 70
start_capture ds402_sinus
at_main 30 chrt -f 60 "$sinus" -i ev0 -s 1 --frequency 0.5 --duration 4 > "$folder/sinus.log" 2>&1 ||
  { cat "$folder/sinus.log"; fail "ds402_sinus: exit code $?"; }
grep "Motor enabled" "$folder/sinus.log" || { cat "$folder/sinus.log"; fail "ds402_sinus does not enable our drive"; }
grep -q "Disabling motor" "$folder/sinus.log" || fail "ds402_sinus does not come to its end"
# It gives a frame 500 us; a busy host takes longer now and then.
echo "ds402_sinus: $(grep -c "bus error" "$folder/sinus.log") frames too late in 4000 cycles"
[ "$(grep -c "bus error" "$folder/sinus.log")" -lt 200 ] || fail "ds402_sinus: too many lost frames"
check_capture ds402_sinus
# 8 degrees of 2^19 counts a turn are 11650; drive 1 follows the seven bytes of drive 0, its position two words and one byte on.
moved=$("$here/ethercat_capture.py" range "$capture" 11)
echo "ds402_sinus: our drive's actual position went from ${moved/ / to } counts, asked for -11650 to 11650"
python3 -c "import sys; sys.exit(not all(11400 < abs(int(end)) < 11660 for end in '$moved'.split()))" ||
  fail "our drive did not follow KickCAT's sine"
check_drives SAFEOP 0x001B 8

source=$(sed -n 's/^KickCAT_SOURCE_DIR:STATIC=//p' "$KICKCAT_PATH/CMakeCache.txt" 2> /dev/null)
if [ ! -e "$source/lib/master/include/kickcat/Bus.h" ] || ! command -v "${CXX:=c++}" > /dev/null; then
  echo "no KickCAT headers or no compiler: its master with SYNC0 is not tried"
  finish
  exit
fi
"$CXX" -std=c++17 -O1 -Wall -Wextra -Werror -isystem "$source/lib/include" -isystem "$source/lib/master/include" \
  -isystem "$source/lib/slave/include" "$here/kickcat_dc.cpp" "$KICKCAT_PATH/lib/libkickcat.a" -ltinyxml2 -lpthread -lrt \
  -o "$folder/kickcat_dc" || { fail "kickcat_dc.cpp does not compile against KickCAT"; finish; exit; }
start_segment "$ftcs" ethercat-segment -i ev1 --drives 8 --priority 70
start_capture kickcat_dc
at_main 60 chrt -f 60 "$folder/kickcat_dc" ev0 10 > "$folder/dc.log" 2>&1 || fail "KickCAT's master with SYNC0: exit code $?"
grep "^KickCAT: 8 SubDevices" "$folder/dc.log" || cat "$folder/dc.log"
check_capture kickcat_dc
"$here/ethercat_capture.py" phase "$capture" 1000000 0 || [ $? -eq 3 ] || fail "no cyclic frames"
# SYNC0 goes on when it has stopped: the drives raise what real ones would.
check_drives SAFEOP 0x001A 8
grep "^drive  0" "$folder/segment.log"
finish
