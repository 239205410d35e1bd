#!/bin/bash
# SPDX-License-Identifier: MIT
# A sweep with GNU parallel: the merged result is that of one process to the byte, also when shards are missing, are
# computed twice, or came out of a run that was killed.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/../cli/common.sh"
here=$(realpath "$(dirname "$0")/../..")
command -v parallel > /dev/null || { echo "SKIPPED: no GNU parallel here (Debian: parallel)"; exit 77; }
cd "$folder" || exit 1
export FTCS=$ftcs
sweep=(simulate "$here/experiments/one-way-grid/grid.toml" --seeds 2)
runs() { "$here/examples/cluster/sweep-parallel" 7 parts "${sweep[@]}"; }

"$ftcs" "${sweep[@]}" -q --json whole.json || fail "one process"
runs > first.txt 2> first.err || fail "sweep"
cmp whole.json parts.json || fail "seven shards together are not the whole"

rm parts/shard-00003-of-00007.json parts.json
: > parts/half.tmp  # what a killed writer leaves has another name
runs > again.txt 2>&1 || fail "the missing shard alone"
cmp whole.json parts.json || fail "with a shard computed later it is not the whole"

cp parts/shard-00002-of-00007.json twice.json
"$ftcs" "${sweep[@]}" -q --merge parts/*.json twice.json --json twice-merged.json || fail "a shard twice"
cmp whole.json twice-merged.json || fail "with a shard twice it is not the whole"

rm parts/shard-00005-of-00007.json
"$ftcs" "${sweep[@]}" -q --merge parts/*.json --json less.json 2> less.err && fail "a missing shard was not noticed"
grep -q 'runs are missing' less.err || fail "no word of the missing shard: $(cat less.err)"
echo "7 shards: $(python3 -c "import json; print(sum(r['runs'] for r in json.load(open('whole.json'))['suite']))") runs"
