#!/bin/sh
# Every fuzz target, or those of FUZZ_TARGETS, for FUZZ_SECONDS (default 60) or FUZZ_RUNS (default: no end), whichever comes first, from
# the committed seeds. A crash is kept in build-fuzz/crashes. What is asked of a release: FUZZ_SECONDS=3600 FUZZ_RUNS=100000000.
set -eu
cd "$(dirname "$0")/../.."
seconds=${FUZZ_SECONDS:-60}
runs=${FUZZ_RUNS:--1}
cmake --preset fuzz > /dev/null
targets=${FUZZ_TARGETS:-$(sed -n 's/^ftcs_fuzz(\([a-z0-9_]*\).*/\1/p' test/fuzz/CMakeLists.txt)}
[ -n "$targets" ] || { echo "fuzz: no target found in test/fuzz/CMakeLists.txt" >&2; exit 1; }
# shellcheck disable=SC2086
cmake --build build-fuzz -j "$(nproc)" --target $targets
mkdir -p build-fuzz/crashes
for target in $targets; do
  grown=build-fuzz/corpus/$target
  mkdir -p "$grown"
  echo "== $target, $seconds s"
  build-fuzz/bin/"$target" -max_total_time="$seconds" -runs="$runs" -print_final_stats=1 -verbosity=0 -report_slow_units=300 \
    -artifact_prefix=build-fuzz/crashes/ "$grown" "test/fuzz/corpus/$target" 2>&1 |
    grep -E 'exec|ERROR|SUMMARY|artifact' || true
  # A pipe hides the exit code: what counts is whether a crash was written.
  if ls build-fuzz/crashes/* > /dev/null 2>&1; then
    echo "fuzz: $target failed; see build-fuzz/crashes" >&2
    exit 1
  fi
done
