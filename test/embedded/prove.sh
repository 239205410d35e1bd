#!/bin/sh
# prove.sh: CBMC (Debian 13 and newer; CBMC names another) over test/embedded/prove.c, every operand. Skipped without it.
set -eu
cd "$(dirname "$0")/../.."
cbmc="${CBMC:-cbmc}"
command -v "$cbmc" > /dev/null || { echo "prove: skipped, cbmc is not installed (Debian 12 has none)"; exit 0; }
for property in difference size times divide; do
  "$cbmc" test/embedded/prove.c --function "prove_$property" --bounds-check --signed-overflow-check \
    --undefined-shift-check --div-by-zero-check --unwind 34 --unwinding-assertions > build-embedded/prove.log ||
    { grep -E 'FAILURE' build-embedded/prove.log; echo "FAILED: prove_$property"; exit 1; }
  echo "  $property: no overflow, no shift out of range, no division by zero, for every operand"
done
"$cbmc" test/embedded/prove.c --function prove_limits --no-standard-checks --unwind 200 --unwinding-assertions > build-embedded/prove.log ||
  { grep -E 'FAILURE' build-embedded/prove.log; echo "FAILED: prove_limits"; exit 1; }
echo "  limits: no addend outside nominal (1 +- F), whatever the servo holds and is fed"
