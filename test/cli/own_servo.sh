#!/bin/bash
# SPDX-License-Identifier: MIT
# A servo of one's own: the examples in C and in Python, both plain FTCS (eq. 18), stand in the tables of compare,
# simulate, paper and of a replay, with the same figures as each other; what is no servo is refused in one sentence.
set -uo pipefail

# shellcheck source=test/cli/common.sh
source "$(dirname "$0")/common.sh"
in_c=$2
in_python=$(realpath "$(dirname "$0")/../../examples/servo/my_servo.py")
cd "$folder" || exit 1

# rms WHAT FILE SERVO: the median RMS of a servo in a result of compare.
rms() {
  python3 -c "import json, sys
rows = json.load(open(sys.argv[1]))['suite']
print(next(r['rms_time_error_ns'] for r in rows if r['servo'] == sys.argv[2]))" "$1" "$2" || fail "no row $2 in $1"
}
# refused SENTENCE COMMAND...: fails, and says so.
refused() {
  local sentence=$1
  shift
  "$@" > out 2> err && fail "$* succeeded"
  grep -q -- "$sentence" err || fail "$*: expected '$sentence', got: $(cat err)"
}

"$ftcs" compare --seeds 2 --servo "$in_c" --servo ftcs-p1 --json c.json > c.txt 2>&1 || fail "compare, C"
grep -q my-servo-c c.txt || fail "not in the table"
grep -q '^adaptive' c.txt && fail "--servo shows others too"
shard() { "$ftcs" compare --seeds 2 --servo "$in_c" --servo ftcs-p1 "$@" -q; }
shard --shard 1/2 --json 1.json && shard --shard 2/2 --json 2.json && shard --merge 1.json 2.json --json both.json ||
  fail "shards"
cmp -s c.json both.json || fail "shards together are not the whole"

"$ftcs" paper --seeds 256 --servo "$in_c" --json paper.json > paper.txt 2>&1 || fail "paper"
python3 - << 'EOT' || fail "the example is not the paper's FTCS1: eq. (18) in the same world"
import json
rows = json.load(open("paper.json"))["tables"]["table2"]
rms = {row["row"]: row["rms_perceived_offset_ns"] for row in rows}
assert abs(rms["my-servo-c"] / rms["FTCS1"] - 1.0) < 0.01, rms
EOT

printf 't1,t2,t3,t4\n' > log.csv
for n in $(seq 1 60); do echo "${n}000000000,${n}000001000,${n}500001000,${n}500002000"; done >> log.csv
"$ftcs" compare --log log.csv --servo "$in_c" > log.txt 2>&1 || fail "replay"
grep -q my-servo-c log.txt || fail "not in the replay"
grep -q '^adaptive' log.txt && fail "a replay shows others too"

refused "not a shared library" "$ftcs" compare --servo ./missing.so
echo text > text.so
refused "not a shared library" "$ftcs" compare --servo ./text.so
refused "exports no ftcs_servo_entry" "$ftcs" compare --servo "$(ldd "$ftcs" | awk '/libm\.so/ { print $3 }')"
refused "no such file" "$ftcs" compare --servo ./missing.py
refused "belongs to --section 4" "$ftcs" paper --section 5 --servo "$in_c"
refused "a .so or .py file" "$ftcs" paper --servo adaptive
refused "exports no" "$ftcs" simulate --servo "$(ldd "$ftcs" | awk '/libm\.so/ { print $3 }')" \
  "$(dirname "$in_python")/../../experiments/peers/010-g100-1s-step.toml"

echo 'x = 1' > entry.py
if ! "$ftcs" compare --seeds 2 --servo "$in_python" --json py.json > py.txt 2>&1; then
  grep -q "no libpython3 here" py.txt && { echo "C: passed; Python: no libpython3 here, not tried"; exit 0; }
  fail "compare, Python"
fi
python=$(rms py.json my-servo-python)
[ -n "$python" ] && [ "$python" = "$(rms c.json my-servo-c)" ] || fail "C and Python differ"
refused "failed or is not there" "$ftcs" compare --servo ./entry.py
sed 's/    return 1$/    raise ValueError("mine")/' "$in_python" > raises.py
refused "raises.py: raised in a callback" "$ftcs" compare --seeds 2 --servo ./raises.py
[ "$(grep -c mine err)" -le 2 ] || fail "the traceback comes more than once: $(wc -l < err) lines"
sed 's/    if last is None:/    if True:/' "$in_python" > silent.py
"$ftcs" compare --seeds 2 --servo ./silent.py > out 2> err || fail "a silent servo: $(cat err)"
grep -q "gave no command in [0-9]* messages" err || fail "a servo without a command is not told: $(cat err)"
sed 's/    command.correction_time_ns = .*/    command.correction_time_ns = -1.0/' "$in_python" > back.py
"$ftcs" compare --seeds 2 --servo ./back.py > out 2> err || fail "a servo that goes back: $(cat err)"
grep -q "were not obeyed" err || fail "commands that were not obeyed are not told: $(cat err)"
sed 's/b"my-servo-python"/b"adaptive"/' "$in_python" > adaptive.py
refused "calls itself adaptive" "$ftcs" compare --seeds 2 --servo ./adaptive.py
refused "one Python script at a time" "$ftcs" compare --servo "$in_python" --servo ./entry.py
echo "C and Python: $python ns, ftcs-p1 $(rms c.json ftcs-p1) ns"
