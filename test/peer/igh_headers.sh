#!/bin/bash
# SPDX-License-Identifier: MIT
# examples/igh_cycle.c and igh_plant_time.c compile against the IgH EtherCAT Master's ecrt.h; link, too, where its user-space
# library is built. They are not run: that needs IgH's kernel module.
#
# IGH_PATH=source tree or prefix of the IgH EtherCAT Master   test/peer/igh_headers.sh [build/ftcs [folder of libftcs_cycle_servo.a]]
# Skipped (77) without it.
set -euo pipefail

skip() { echo "skipped: $*"; exit 77; }
[ -n "${IGH_PATH:-}" ] || skip "IGH_PATH names no IgH EtherCAT Master"
[ -e "$IGH_PATH/include/ecrt.h" ] || skip "$IGH_PATH holds no include/ecrt.h"
project=$(realpath "$(dirname "$0")/../..")
libraries=$(realpath "${2:-build/layer/discipline}")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

library=$(find "$IGH_PATH/lib" -name "libethercat.a" -o -name "libethercat.so" 2> /dev/null | head -1)
for example in igh_cycle igh_plant_time; do
  "${CC:=cc}" -std=c99 -Wall -Wextra -Werror -O2 -I"$project" -isystem "$IGH_PATH/include" -c "$project/examples/$example.c" \
    -o "$folder/$example.o"
  echo "examples/$example.c compiles against $IGH_PATH/include/ecrt.h"
  [ -n "$library" ] || { echo "no libethercat there: not linked"; continue; }
  "$CC" "$folder/$example.o" "$libraries/libftcs_cycle_servo.a" "$library" -lm -o "$folder/$example"
  echo "and links with $library"
done
