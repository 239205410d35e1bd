#!/bin/bash
# SPDX-License-Identifier: MIT
# Plant time in SOEM's loop (examples/soem_plant_time.c, compiled against SOEM's headers and library) on our segment over
# veth: four drives, reference +40 ppm, plant time CLOCK_REALTIME. Both locked, all in OP, and the drives' clock on plant
# time, as the clock of the host shows that both share: what SOEM's send takes remains, but it does not grow.
#
# SOEM_PATH=build folder of SOEM 2   test/peer/soem_plant_time.sh [build/ftcs [folder of libftcs_cycle_servo.a [seconds]]]
# Skipped (77) without it. SOEM is GPL: what is linked here with it is linked for this test and never given away.
# shellcheck source=test/peer/ethercat_common.sh
. "$(dirname "$0")/ethercat_common.sh"

ftcs=$(realpath "${1:-build/ftcs}")
libraries=$(realpath "${2:-build/layer/discipline}")
seconds=${3:-25}
[ -n "${SOEM_PATH:-}" ] || skip "SOEM_PATH names no build folder of SOEM"
source=$(sed -n 's/^SOEM_SOURCE_DIR:STATIC=//p' "$SOEM_PATH/CMakeCache.txt" 2> /dev/null)
for file in "$SOEM_PATH/libsoem.a" "$source/include/soem/soem.h"; do
  [ -e "$file" ] || skip "there is no $file"
done
make_segment_network "${CC:=cc}"
project=$(realpath "$here/../..")

"$CC" -std=c99 -Wall -Wextra -Werror -O2 -I"$project" -isystem "$source/include" -isystem "$SOEM_PATH/include" \
  -isystem "$source/osal" -isystem "$source/osal/linux" -isystem "$source/oshw/linux" "$project/examples/soem_plant_time.c" \
  "$libraries/libftcs_cycle_servo.a" "$SOEM_PATH/libsoem.a" -lm -lpthread -lrt -o "$folder/soem_plant_time" ||
  { fail "examples/soem_plant_time.c does not compile against SOEM"; finish; }
echo "examples/soem_plant_time.c compiles and links against SOEM"

start_segment "$ftcs" ethercat-segment -i ev1 --drives 4 --ppm=40,-30,30 --priority 70 --clock-csv "$folder/clock.csv"
at_main "$((seconds + 20))" "$folder/soem_plant_time" ev0 realtime "$seconds" 2>&1 | tr '\r' '\n' | tee "$folder/log"
[ "${PIPESTATUS[0]}" -eq 0 ] || fail "not locked, or not in OP"
stop_segment

python3 - "$folder/clock.csv" << 'PY' || fail "the drives' clock is not on plant time"
import csv, statistics, sys, time

EPOCH_NS = 946_684_800 * 10**9
readings = []
for _ in range(1000):
    before, shown, after = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
    readings.append((after - before, shown - (before + after) // 2))
ahead = min(readings)[1]
rows = [(int(r[0]), int(r[1])) for r in csv.reader(open(sys.argv[1])) if len(r) == 2]
last = rows[-1][0] - 1_000_000_000  # the way down is not judged
off = [dc + EPOCH_NS - (t + ahead) for t, dc in rows if last - 5_000_000_000 < t < last]
middle = statistics.median(off)
spread = sorted(abs(v - middle) for v in off)
p99 = spread[int(0.99 * len(spread))]
print(f"drives' clock less plant time, last 5 s: median {middle / 1000:+.1f} us, 99 % within {p99 / 1000:.2f} us of it")
sys.exit(0 if abs(middle) < 100_000 and p99 < 10_000 else 1)
PY
finish
