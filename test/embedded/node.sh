#!/bin/bash
# node.sh BUILD_EMBEDDED: node.cpp on qemu's mps2-an386 with a LAN9118, in a network namespace of its own, against
# `build/ftcs ptp --role time-transmitter` on a tap device. It must be locked at the third Sync that it hears. Skipped where
# that is not permitted. A host that does something else for milliseconds makes a stamp as late: both programs run with
# real-time priority, or where that is not permitted three attempts are made.
set -uo pipefail
cd "$(dirname "$0")/../.."
out="$1"
skip() { echo "node: skipped, $1"; exit 0; }
[ -x build/ftcs ] || skip "build/ftcs is not built (make)"
[ -e /dev/net/tun ] || skip "no /dev/net/tun"
command -v ip > /dev/null || skip "no iproute2"

target=(-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard -mthumb -Os -ffunction-sections -fdata-sections -ffp-contract=off)
arm-none-eabi-g++ "${target[@]}" -std=c++20 -fno-exceptions -fno-rtti -fno-threadsafe-statics -Wall -Wextra -I. -Iembedded \
  -Itest/embedded/board -Itest/embedded test/embedded/node.cpp "$out"/m4f/{ftcs_addend,ftcs_addend_actuator,ftcs_addend_arithmetic,ftcs_addend_quiet,startup,line}.o \
  "$out"/m4f/core/layer/{ptp/libftcs_ptp,clock/libftcs_clock}.a -nostartfiles --specs=nano.specs -Wl,--gc-sections \
  -T test/embedded/board/mps2.ld -o "$out/m4f/node.elf" || exit 1
arm-none-eabi-size "$out/m4f/node.elf" | awk 'END {print "  " $1 " bytes of code, " $2 + $3 " of data"}'

first=(chrt -f 1)
attempts=1
"${first[@]}" true 2> /dev/null || { first=() attempts=3; }
ns="ftcs-node-$$"
ip netns add "$ns" 2> /dev/null || skip "may not make network namespaces"
transmitter=""
cleanup() {
  [ -z "$transmitter" ] || { kill "$transmitter"; wait "$transmitter"; } 2> /dev/null
  ip netns del "$ns"
}
trap cleanup EXIT
ip netns exec "$ns" sh -c "ip tuntap add dev tap0 mode tap && ip link set tap0 up" 2> /dev/null || skip "no tap device"
ip netns exec "$ns" "${first[@]}" build/ftcs ptp -i tap0 -2 -S --role time-transmitter --duration 120 > "$out/transmitter.log" 2>&1 &
transmitter=$!

for attempt in $(seq "$attempts"); do
  ip netns exec "$ns" "${first[@]}" timeout 60 qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none \
    -semihosting-config enable=on,target=native -nic tap,ifname=tap0,script=no,downscript=no,model=lan9118 \
    -kernel "$out/m4f/node.elf" < /dev/null > "$out/node.txt" 2>&1
  code=$?
  syncs=$(sed -n 's/^Sync \([0-9]*\) .*/\1/p' "$out/node.txt" | tail -1)
  sed 's/^/  /' "$out/node.txt"
  if [ "$code" -eq 0 ] && [ "${syncs:-99}" -le 3 ]; then exit 0; fi
  echo "  attempt $attempt of $attempts: code $code after ${syncs:-no} Syncs, expected to be locked at the third"
done
exit 1
