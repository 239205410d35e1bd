#!/bin/bash
# make test-embedded: compiles the core and ftcs_addend for Cortex-M4F, M7 and M0+, runs programs of both under
# qemu-system-arm and compares what they print with x86's, bit for bit. Sizes and instructions of ftcs_addend are printed and
# held to limits. Without the cross compiler or QEMU (root or sudo installs them on Debian) it is skipped, with the reason.
set -euo pipefail
cd "$(dirname "$0")/../.."
here=test/embedded
out=build-embedded
failures=0
fail() { echo "FAILED: $*"; failures=$((failures + 1)); }

tools/install-deps embedded || true
for tool in arm-none-eabi-g++ qemu-system-arm cmake ninja; do
  command -v "$tool" > /dev/null || { echo "test-embedded: skipped, $tool is not installed"; exit 0; }
done

declare -A flags=([m4f]="-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard" [m7]="-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard"
  [m0plus]="-mcpu=cortex-m0plus -mfloat-abi=soft")
declare -A board=([m4f]=mps2-an386 [m7]=mps2-an500 [m0plus]=mps2-an385)
# Limits: bytes of everything; of FTCS alone (built with FTCS_ADDEND_BARE: ftcs_addend_start and ftcs_addend_take), with
# ftcs_addend_init in it too; instructions of an FTCS update, mean and most of 10,000 (ftcs_addend_take and nothing else).
declare -A limit_all=([m4f]=4096 [m7]=4096 [m0plus]=4608) limit_ftcs=([m4f]=2048 [m7]=2048 [m0plus]=2400)
declare -A limit_init=([m4f]=2048 [m7]=2064 [m0plus]=2600) limit_count=([m4f]=600 [m7]=600 [m0plus]=2000)
declare -A limit_whole=([m4f]=2048 [m7]=2048 [m0plus]=3200) limit_most=([m4f]=600 [m7]=600 [m0plus]=2100)
common=(-mthumb -Os -ffunction-sections -fdata-sections -ffp-contract=off -I. -Iembedded -I"$here/board")
link=(-nostartfiles --specs=nano.specs -Wl,--gc-sections -T "$here/board/mps2.ld")
startup=("$here/board/startup.c" "$here/board/line.c")
addend=(embedded/ftcs_addend*.c)
strict=(-std=c99 -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion -Wstrict-prototypes
  -Wmissing-prototypes -Werror)

emulate() {  # machine, image; -icount: an instruction takes 256 ns
  timeout 570 qemu-system-arm -M "$1" -nographic -monitor none -serial none -semihosting-config enable=on,target=native \
    -icount shift=8,sleep=off -kernel "$2" < /dev/null 2>&1
}
same() {  # what, ours, theirs
  if diff <(grep -v '^#' "$2") <(grep -v '^#' "$3") > "$out/diff"; then
    echo "  $1: the same bits as x86"
  else
    fail "$1 differs from x86:"
    cat "$out/diff"
  fi
}
bytes() { "$1-size" -t "${@:2}" | awk 'END {print $1}'; }

mkdir -p "$out/x86"
echo "== x86"
host=(-O2 -ffp-contract=off -I. -Iembedded -I"$here/board")
gcc "${host[@]}" -std=c99 -DSAMPLES=1000000 "$here"/{addend_run,board/line,board/host}.c "${addend[@]}" -o "$out/x86/addend_long"
gcc "${host[@]}" -std=c99 "$here"/{addend_run,board/line,board/host}.c "${addend[@]}" -o "$out/x86/addend"
gcc "${host[@]}" -std=c99 -DFTCS_ADDEND_BARE "$here"/{addend_run,board/line,board/host}.c "${addend[@]}" -o "$out/x86/addend_bare"
for compiler in gcc clang; do  # without built-in functions and products of two words: for other compilers and processors
  command -v "$compiler" > /dev/null || continue
  "$compiler" "${host[@]}" -std=c99 -DFTCS_ADDEND_PORTABLE -DFTCS_ADDEND_NARROW "$here"/{addend_run,board/line,board/host}.c "${addend[@]}" \
    -o "$out/x86/addend_$compiler"
  for file in "${addend[@]}"; do "$compiler" "${strict[@]}" -O2 -c "$file" -o "$out/x86/strict.o"; done
done
cmake -S . -B "$out/x86/core" -G Ninja -DFTCS_CORE_ONLY=ON -DCMAKE_BUILD_TYPE=Release > "$out/x86/configure.log"
cmake --build "$out/x86/core" > "$out/x86/build.log" || { tail -20 "$out/x86/build.log"; exit 1; }
libraries=(layer/discipline/libftcs_cycle_servo.a layer/servo/libftcs_servo.a layer/measurement/libftcs_measurement.a
  layer/estimation/libftcs_estimation.a layer/clock/libftcs_clock.a)
archives() {
  for library in "${libraries[@]}"; do if [ -e "$1/$library" ]; then echo "$1/$library"; fi; done
}
gcc "${host[@]}" -std=c99 -c "$here/board/line.c" -o "$out/x86/line.o"
gcc "${host[@]}" -std=c99 -c "$here/board/host.c" -o "$out/x86/host.o"
# shellcheck disable=SC2046
g++ "${host[@]}" -std=c++20 "$here/core_run.cpp" "$out"/x86/{line,host}.o $(archives "$out/x86/core") -o "$out/x86/core_run"
for program in addend_long addend addend_bare core_run; do "$out/x86/$program" > "$out/x86/$program.txt"; done
head -n "$(wc -l < "$out/x86/addend_bare.txt")" "$out/x86/addend.txt" > "$out/x86/addend_head.txt"
same "ftcs_addend without options, and with them unused," "$out/x86/addend_bare.txt" "$out/x86/addend_head.txt"
for compiler in gcc clang; do
  [ -x "$out/x86/addend_$compiler" ] || continue
  "$out/x86/addend_$compiler" > "$out/x86/addend_$compiler.txt"
  same "portable ftcs_addend by $compiler" "$out/x86/addend_$compiler.txt" "$out/x86/addend.txt"
done

for cpu in m4f m7 m0plus; do
  echo "== Cortex-$cpu"
  mkdir -p "$out/$cpu"
  read -ra target <<< "${flags[$cpu]}"
  cmake -S . -B "$out/$cpu/core" -G Ninja --toolchain cmake/toolchains/arm-none-eabi.cmake -DFTCS_CPU=$cpu -DFTCS_CORE_ONLY=ON \
    -DCMAKE_BUILD_TYPE=MinSizeRel > "$out/$cpu/configure.log" 2>&1
  cmake --build "$out/$cpu/core" > "$out/$cpu/build.log" || { fail "the core for $cpu"; grep -E 'error' "$out/$cpu/build.log"; continue; }
  echo "  the core compiles: $(find "$out/$cpu/core" -name '*.obj' | wc -l) objects, warnings as errors"

  objects=()
  for file in "${addend[@]}"; do
    objects+=("$out/$cpu/$(basename "$file" .c).o")
    arm-none-eabi-gcc "${target[@]}" "${common[@]}" "${strict[@]}" -c "$file" -o "${objects[-1]}"
  done
  if arm-none-eabi-nm -u "${objects[@]}" | grep -E '__aeabi_(d|f|i2|ui2|l2|ul2)|malloc|_sbrk'; then
    fail "ftcs_addend for $cpu reaches for floating point or a heap"
  fi
  for example in stm32_ptp_clock bare_metal; do
    arm-none-eabi-gcc "${target[@]}" "${common[@]}" "${strict[@]}" -Wno-missing-prototypes -c examples/embedded/$example.c \
      -o "$out/$cpu/$example.o"
  done
  arm-none-eabi-gcc "${target[@]}" "${common[@]}" -std=c99 -Wall -Wextra -Wconversion -Wsign-conversion -Werror \
    -I"$here/zephyr_stub" -c examples/embedded/zephyr/src/ftcs_ptp_servo.c -o "$out/$cpu/zephyr.o"
  arm-none-eabi-gcc "${target[@]}" "${common[@]}" -std=gnu99 "${startup[@]}" "$here/addend_run.c" "${objects[@]}" "${link[@]}" \
    -o "$out/$cpu/addend.elf"
  emulate "${board[$cpu]}" "$out/$cpu/addend.elf" > "$out/$cpu/addend.txt"
  same "ftcs_addend" "$out/$cpu/addend.txt" "$out/x86/addend.txt"

  bare=()
  for file in "${addend[@]}"; do
    bare+=("$out/$cpu/$(basename "$file" .c)_bare.o")
    arm-none-eabi-gcc "${target[@]}" "${common[@]}" "${strict[@]}" -DFTCS_ADDEND_BARE -c "$file" -o "${bare[-1]}"
  done
  arm-none-eabi-gcc "${target[@]}" "${common[@]}" -std=gnu99 -DFTCS_ADDEND_BARE "${startup[@]}" "$here/addend_run.c" \
    "${bare[@]}" "${link[@]}" -o "$out/$cpu/addend_bare.elf"
  emulate "${board[$cpu]}" "$out/$cpu/addend_bare.elf" > "$out/$cpu/addend_bare.txt"
  same "ftcs_addend without options" "$out/$cpu/addend_bare.txt" "$out/x86/addend_bare.txt"

  for start in start init; do
    arm-none-eabi-gcc "${target[@]}" "${common[@]}" -std=c99 "-DSTART=ftcs_addend_$start" "$here/footprint.c" "${bare[@]}" \
      "${startup[@]}" "${link[@]}" -o "$out/$cpu/alone_$start.elf"
  done
  # Linked as a whole (-flto), where the linker sees that the configuration is a constant: what an image of nothing grows by.
  for what in FTCS NOTHING; do
    arm-none-eabi-gcc "${target[@]}" "${common[@]}" -flto -std=gnu99 -DFTCS_ADDEND_BARE -DSTART=ftcs_addend_init "-D$what" \
      "$here/footprint.c" "${addend[@]}" "${startup[@]}" "${link[@]}" -o "$out/$cpu/whole_$what.elf"
  done
  whole=$(($(bytes arm-none-eabi "$out/$cpu/whole_FTCS.elf") - $(bytes arm-none-eabi "$out/$cpu/whole_NOTHING.elf")))
  all=$(bytes arm-none-eabi "${objects[@]}")
  alone=$("$here/own_bytes.sh" "$out/$cpu/alone_start.elf" "${bare[@]}")
  checked=$("$here/own_bytes.sh" "$out/$cpu/alone_init.elf" "${bare[@]}")
  read -r count most < <(sed -n 's/^# instructions of an update, ftcs: mean \([0-9]*\) most \([0-9]*\)$/\1 \2/p' "$out/$cpu/addend.txt")
  echo "  ftcs_addend: $all bytes with everything, $alone bytes for FTCS alone, $checked with ftcs_addend_init" \
    "($whole with -flto)"
  grep '^#' "$out/$cpu/addend.txt" | sed 's/^#/ /'
  at_most() {  # what, figure, limit
    [ "$2" -le "$3" ] || fail "$cpu: $1 $2, at most $3"
  }
  at_most "bytes with everything" "$all" "${limit_all[$cpu]}"
  at_most "bytes of FTCS alone" "$alone" "${limit_ftcs[$cpu]}"
  at_most "bytes of FTCS alone with ftcs_addend_init" "$checked" "${limit_init[$cpu]}"
  at_most "bytes of FTCS alone with ftcs_addend_init and -flto" "$whole" "${limit_whole[$cpu]}"
  at_most "instructions" "$count" "${limit_count[$cpu]}"
  at_most "most instructions" "$most" "${limit_most[$cpu]}"

  for part in startup line; do
    arm-none-eabi-gcc "${target[@]}" "${common[@]}" -std=gnu99 -c "$here/board/$part.c" -o "$out/$cpu/$part.o"
  done
  # shellcheck disable=SC2046
  arm-none-eabi-g++ "${target[@]}" "${common[@]}" -std=c++20 -fno-exceptions -fno-rtti -fno-threadsafe-statics "$here/core_run.cpp" \
    "$out/$cpu"/{startup,line}.o $(archives "$out/$cpu/core") "${link[@]}" -o "$out/$cpu/core_run.elf"
  heap=$(arm-none-eabi-nm "$out/$cpu/core_run.elf" | awk '$3 ~ /^(malloc|_malloc_r|_sbrk|abort|_exit)$/ {print $3}')
  [ -z "$heap" ] || fail "core_run for $cpu links" $heap
  emulate "${board[$cpu]}" "$out/$cpu/core_run.elf" > "$out/$cpu/core_run.txt"
  same "servos of the core" "$out/$cpu/core_run.txt" "$out/x86/core_run.txt"
done

echo "== ftcs_addend, 10^6 random samples, Cortex-M0+ against x86"
read -ra target <<< "${flags[m0plus]}"
arm-none-eabi-gcc "${target[@]}" "${common[@]}" -std=gnu99 -DSAMPLES=1000000 "${startup[@]}" "$here/addend_run.c" \
  "${addend[@]}" "${link[@]}" -o "$out/m0plus/addend_long.elf"
emulate mps2-an385 "$out/m0plus/addend_long.elf" > "$out/m0plus/addend_long.txt"
same "10^6 samples" "$out/m0plus/addend_long.txt" "$out/x86/addend_long.txt"

echo "== a whole node: PTP receiver and ftcs_addend on a Cortex-M4 with an emulated Ethernet, against our transmitter"
"$here/node.sh" "$out" || fail "the node"

echo "== proofs"
"$here/prove.sh" || fail "a proof"

[ "$failures" -eq 0 ] || { echo "test-embedded: $failures failures"; exit 1; }
echo "test-embedded: passed (QEMU, not silicon)"
