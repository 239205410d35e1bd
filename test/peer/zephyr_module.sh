#!/bin/bash
# SPDX-License-Identifier: MIT
# examples/embedded/zephyr as a module of Zephyr: compiled and linked with its kernel, and run under QEMU, where a modelled
# PTP clock locks.
#
# ZEPHYR_BASE=Zephyr's tree [ZEPHYR_MODULES=hal/cmsis, where west does not know it]   test/peer/zephyr_module.sh
# Skipped (77) without it. The toolchain is Zephyr's SDK, or Debian's gcc-arm-none-eabi where ZEPHYR_TOOLCHAIN_VARIANT is unset.
set -euo pipefail

skip() { echo "skipped: $*"; exit 77; }
[ -n "${ZEPHYR_BASE:-}" ] || skip "ZEPHYR_BASE names no tree of Zephyr"
command -v qemu-system-arm > /dev/null || skip "no qemu-system-arm"
if [ -z "${ZEPHYR_TOOLCHAIN_VARIANT:-}" ]; then
  command -v arm-none-eabi-gcc > /dev/null || skip "no toolchain: ZEPHYR_TOOLCHAIN_VARIANT is unset, no arm-none-eabi-gcc"
  export ZEPHYR_TOOLCHAIN_VARIANT=gnuarmemb
  GNUARMEMB_TOOLCHAIN_PATH=$(dirname "$(dirname "$(command -v arm-none-eabi-gcc)")")
  export GNUARMEMB_TOOLCHAIN_PATH
fi
project=$(realpath "$(dirname "$0")/../..")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cmake -G Ninja -S "$project/test/peer/zephyr_app" -B "$folder" -DBOARD=mps2_an385 -DUSER_CACHE_DIR="$folder/cache" \
  -DPython3_EXECUTABLE="${PYTHON:-/usr/bin/python3}" ${ZEPHYR_MODULES:+"-DZEPHYR_MODULES=$ZEPHYR_MODULES"} \
  "-DZEPHYR_EXTRA_MODULES=$project/examples/embedded/zephyr" > "$folder/log" 2>&1 || { tail -20 "$folder/log"; exit 1; }
cmake --build "$folder" > "$folder/log" 2>&1 || { grep -E 'error|warning' "$folder/log"; exit 1; }
# The image goes on for ever: the emulator is ended when it has said how it went.
timeout 60 qemu-system-arm -M mps2-an385 -nographic -monitor none -serial stdio -icount shift=6,sleep=off \
  -kernel "$folder/zephyr/zephyr.elf" < /dev/null 2>&1 | sed '/locked at Sync/q; /not locked/q; /refused/q' > "$folder/said" || true
cat "$folder/said"
version=$(awk '/^VERSION_MAJOR|^VERSION_MINOR|^PATCHLEVEL/ {v = v sep $3; sep = "."} END {print v}' "$ZEPHYR_BASE/VERSION")
grep -q '^locked at Sync [1-5]\>' "$folder/said" || { echo "expected: locked by the fifth Sync"; exit 1; }
echo "examples/embedded/zephyr: builds with Zephyr $version, and its clock locks"
