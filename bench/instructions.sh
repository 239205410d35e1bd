#!/bin/sh
# SPDX-License-Identifier: MIT
# Instructions per step of each benchmark case: callgrind counts a short and a long run, the difference is free of
# start-up. Repeatable to the last digit where wall time is not. usage: bench/instructions.sh [BUILD_DIRECTORY] [CASE...]
set -eu
build=${1:-build-release}
[ $# -gt 0 ] && shift
program=$build/bin/ftcs_bench_steps
if ! command -v valgrind > /dev/null; then
  echo "instructions: skipped, valgrind is not installed"
  exit 0
fi
short=2000
long=12000

count() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$1" "$2" 2>&1 |
    sed -n 's/.*Collected : \([0-9]*\).*/\1/p'
}

[ $# -gt 0 ] || set -- $("$program")
printf '%-24s %s\n' case instructions
for name in "$@"; do
  few=$(count "$name" $short)
  many=$(count "$name" $long)
  printf '%-24s %12d\n' "$name" $(((many - few) / (long - short)))
done
