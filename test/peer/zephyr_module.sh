#!/bin/bash
# SPDX-License-Identifier: MIT
# examples/embedded/zephyr builds as a module of Zephyr's own PTP sample.
#
# ZEPHYR_BASE=Zephyr's tree, with west and an SDK   test/peer/zephyr_module.sh [ignored [board]]
# Skipped (77) without it.
set -euo pipefail

skip() { echo "skipped: $*"; exit 77; }
[ -n "${ZEPHYR_BASE:-}" ] || skip "ZEPHYR_BASE names no tree of Zephyr"
command -v west > /dev/null || skip "no west"
project=$(realpath "$(dirname "$0")/../..")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$ZEPHYR_BASE"
west build -p always -b "${2:-nucleo_h743zi}" -d "$folder/build" samples/net/ptp -- \
  -DZEPHYR_EXTRA_MODULES="$project/examples/embedded/zephyr" -DCONFIG_FTCS_PTP_SERVO=y
echo "examples/embedded/zephyr builds with $ZEPHYR_BASE"
