#!/bin/sh
# SPDX-License-Identifier: MIT
# Installs a built tree into a folder of its own and uses it from there: the program runs, a C project finds the library with
# find_package() and with pkg-config, links no C++ run-time library, and locks; a C++ project does the same with the
# layers, and every installed header includes nothing that is not installed.
set -eu

build=$(realpath "$1")
here=$(dirname "$(realpath "$0")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/prefix" > "$work/log" || { cat "$work/log"; exit 1; }
mv "$work/prefix" "$work/moved"  # nothing may remember where it was installed
"$work/moved/bin/ftcs" --version

cp -r "$here/consumer" "$work/consumer"
cmake -S "$work/consumer" -B "$work/consumer/build" -DCMAKE_PREFIX_PATH="$work/moved" > "$work/log" 2>&1 &&
  cmake --build "$work/consumer/build" >> "$work/log" 2>&1 || { cat "$work/log"; exit 1; }
for library in ftcs_cycle_servo ftcs_cycle_servo_small; do
  program=$work/consumer/build/uses_$library
  "$program"
  if ldd "$program" | grep -q 'libstdc++'; then echo "$library: a C program links the C++ library" >&2; exit 1; fi
done

"$work/consumer/build/uses_layers"
find "$work/moved/include" -name '*.h' ! -name 'ftcs_*.h' -printf '#include "%P"\n' | sort > "$work/all.cpp"
${CXX:-c++} -std=c++20 -fsyntax-only -I"$work/moved/include" "$work/all.cpp"
echo "$(wc -l < "$work/all.cpp") headers are complete"

command -v pkg-config > /dev/null || { echo "no pkg-config here: not tried"; exit 0; }
PKG_CONFIG_PATH=$(dirname "$(find "$work/moved" -name ftcs_cycle_servo.pc)")
export PKG_CONFIG_PATH
for library in ftcs_cycle_servo ftcs_cycle_servo_small; do
  # shellcheck disable=SC2046
  ${CC:-cc} -std=c99 -o "$work/$library" "$here/consumer/main.c" $(pkg-config --cflags --libs "$library")
  "$work/$library"
done
# Into a shared object, as LinuxCNC's drivers are: whole, and with nothing left undefined.
# shellcheck disable=SC2046
${CC:-cc} -shared -Wl,-z,defs -Wl,--whole-archive $(pkg-config --libs ftcs_cycle_servo) -Wl,--no-whole-archive \
  -o "$work/driver.so"
echo "linked into a shared object"
# shellcheck disable=SC2046
${CXX:-c++} -std=c++20 -o "$work/layers" "$here/consumer/main.cpp" $(pkg-config --cflags --libs ftcs)
"$work/layers"
