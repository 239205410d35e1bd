#!/bin/bash
# SPDX-License-Identifier: MIT
# The laboratory as a user meets it: mistakes in files cost one line, shards merge to the whole, results survive.
set -uo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
failures=0
fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

expect() {  # exit code, text that the one line must hold, arguments...
  local code=$1 text=$2 result
  shift 2
  timeout 60 "$ftcs" "$@" > out 2> err
  result=$?
  if [ "$result" -ne "$code" ] || [ "$(wc -l < err)" -ne 1 ] || ! grep -qF -- "$text" err; then
    fail "ftcs $*: exit code $result, expected $code and one line with '$text'; got: $(cat err)"
  fi
}

cat > good.toml <<'TOML'
title = "good"
servos = ["ftcs", "adaptive"]

[run]
sync_interval = "1 s"
cycles = 40
seeds = 5

[path]
delay = "10 us"
jitter = { kind = "gaussian", sigma = "100 ns" }
TOML

sed 's/seeds = 5/seed = 5/' good.toml > unknown.toml
sed 's/"10 us"/"10 ppm"/' good.toml > unit.toml
sed 's/"10 us"/"-10 us"/' good.toml > negative.toml
sed 's/\[run\]/[run/' good.toml > syntax.toml
head -c 300 /dev/urandom > binary.toml
: > empty.toml
expect 2 'unknown.toml:7:1: unknown key seed in [run] (did you mean seeds?)' simulate unknown.toml
expect 2 'unit.toml:10:9: delay = "10 ppm" is not a time' simulate unit.toml
expect 2 'negative.toml:10:9: delay = -10000 is out of range' simulate negative.toml
expect 2 'syntax.toml:' simulate syntax.toml
expect 2 'binary.toml' simulate binary.toml
expect 2 'a scenario needs a [run] table' simulate empty.toml
expect 2 'none.toml: cannot be read' simulate none.toml
expect 1 'no scenario files' compare --suite none
# What follows an option that is misspelt is no argument; the option is what is named.
expect 2 "unknown option '--servoo'; did you mean '--servo'?" compare --suite networks --servoo adaptive
expect 2 '--seeds: Value x not in range' compare --seeds x -- good.toml
for shard in 3/2 0/2 1/0 1 /2 1/ 1/2/3 -1/2 one/two; do
  expect 2 "simulate: --shard: expected i/n with 1 <= i <= n, got $shard" simulate good.toml --json part.json --shard=$shard
done
for command in 'simulate good.toml' 'compare good.toml' 'compare'; do
  # shellcheck disable=SC2086
  expect 2 '--shard requires --json' $command --shard 1/2
done
[ -e part.json ] && fail "a wrong shard began to run"
expect 1 '--trace follows one scenario' simulate good.toml good.toml --trace t.csv
expect 1 'not a result of --shard' simulate good.toml --merge good.toml
expect 1 'none.log' compare --log none.log
expect 1 'empty.toml: no line of a known format' compare --log empty.toml
expect 1 'binary.toml' compare --log binary.toml
expect 1 'No space left on device' simulate good.toml -q --json /dev/full

# What is read is never written over, nor one result over another: links and other spellings are the same file.
printf 'time_s,offset_ns\n0,5\n1,-3\n2,4\n3,0\n4,1\n' > record.csv
cp record.csv record.kept
cp good.toml good.kept
ln -s record.csv record.link
ln record.csv record.hard
for name in record.csv ./record.csv "$folder/record.csv" record.link record.hard; do
  for flag in --json --csv --html; do
    expect 2 "$flag $name would overwrite what is read: FILE record.csv is the same file" analyse record.csv $flag "$name"
    expect 2 "$flag $name would overwrite what is read: --log record.csv is the same file" compare --log record.csv $flag "$name"
  done
done
expect 2 '--trace record.csv would overwrite what is read' compare --log record.csv --trace record.csv
# shellcheck disable=SC2094
expect 2 '--csv record.csv would overwrite what is read: FILE - is the same file' analyse - --csv record.csv < record.csv
expect 2 '--csv ./same would overwrite another result: --json same is the same file' analyse record.csv --json same --csv ./same
expect 2 '--html same would overwrite another result: --csv same' compare good.toml --csv same --html same
expect 2 '--json good.toml would overwrite what is read: FILE good.toml' simulate good.toml --json good.toml
expect 2 '--csv good.toml would overwrite what is read: FILE good.toml' compare good.toml --csv good.toml
expect 2 '--json part.json would overwrite what is read: --merge part.json' simulate good.toml --merge part.json --json part.json
expect 2 '--csv same would overwrite another result: --json same' paper --json same --csv same
expect 2 '--html same would overwrite another result: --json same' demo --json same --html same
cmp record.csv record.kept || fail "the record was written over"
cmp good.toml good.kept || fail "the scenario was written over"
[ -e same ] && fail "a refused result was begun"
"$ftcs" analyse record.csv -q --json /dev/null --csv /dev/null || fail "a device takes any number of results"
mkdir suite
cp good.toml suite/
expect 2 '--csv suite/good.toml would overwrite what is read: --suite suite/good.toml' compare --suite suite --csv suite/good.toml

# Results that cannot be written are known before anything runs (these runs would take hours or minutes), and
# what exists stays until there is something to write.
sed 's/seeds = 5/seeds = 1000000/' good.toml > endless.toml
for flag in --json --csv --html --trace; do
  expect 1 'cannot write none/x: No such file or directory' simulate endless.toml $flag none/x
  [ -s out ] && fail "$flag none/x: the run began"
done
for flag in --json --csv --html; do
  expect 1 'cannot write none/x: No such file or directory' compare endless.toml $flag none/x
  expect 1 'cannot write .: Is a directory' compare endless.toml $flag .
  expect 1 'cannot write none/x: No such file or directory' compare --log good.toml $flag none/x
  expect 1 'cannot write none/x: No such file or directory' analyse good.toml $flag none/x
  expect 1 'cannot write none/x: No such file or directory' paper --seeds 1000000 $flag none/x
  expect 1 'cannot write none/x: No such file or directory' paper --section 5 --seeds 1000000 $flag none/x
  [ -s out ] && fail "paper $flag none/x: the run began"
done
for flag in --json --html; do
  expect 1 'cannot write none/x: No such file or directory' demo --duration 3 $flag none/x
  [ -s out ] && fail "demo $flag none/x: the run began"
done
echo precious > old.json
expect 1 'none.log' compare --log none.log --json old.json
(timeout -s KILL 1 "$ftcs" simulate endless.toml -q --json old.json) > /dev/null 2>&1
[ "$(cat old.json)" = precious ] || fail "a run without a result cost the older one"
rm -f old.json.part
# A single run of a year ends when it is asked to, with what it has.
sed 's/^cycles = .*/cycles = 30000000000/; s/seeds = 5/seeds = 1/' good.toml > year.toml
timeout -s INT -k 60 4 "$ftcs" simulate year.toml -q > /dev/null 2> err
[ $? -eq 137 ] && fail "a long run did not end at SIGINT"
grep -q interrupted err || fail "an interrupted run does not say so: $(cat err)"
expect 2 '--servo adaptve: expected a file or one of' simulate good.toml --servo adaptve
expect 2 '--servo adaptve: expected a file or one of' simulate --servo adaptve good.toml

# Logs and records: cut off in the middle, compressed and cut off, no text at all.
for i in $(seq 400); do echo "$i,$((i * 20000))"; done > data
{ echo "time_s,offset_ns"; cat data; } > good.csv
gzip -k good.csv
head -c 900 good.csv.gz > cut.csv.gz
head -c 20 good.csv > cut.csv
expect 1 'cut.csv.gz' compare --log cut.csv.gz
expect 1 'only 1 usable lines of 2; three are needed' compare --log cut.csv
expect 1 'cut.csv.gz' analyse cut.csv.gz
expect 1 'empty.toml' analyse empty.toml
expect 1 'binary.toml' analyse binary.toml
expect 1 'none.csv' analyse none.csv

# A full disk takes one result, never the others or the console's table.
# A record is one run: options that draw, share or join runs mean nothing to it, and others must be honoured.
expect 2 '--log excludes --seeds' compare --log good.csv --seeds 3
expect 2 '--log excludes --shard' compare --log good.csv --shard 1/2
expect 2 '--servo nobody' compare --log good.csv --servo nobody
expect 1 "no source 'ptp4l'" compare --log good.csv --source ptp4l
"$ftcs" compare -q --log good.csv --servo ftcs --trace replay.csv || fail "compare --log --trace"
[ "$(cut -d, -f1 replay.csv | sort -u | tr '\n' ' ')" = "ftcs servo " ] || fail "the trace is not of the servo asked for"
expect 1 'No space left on device' compare --log good.csv -q --json /dev/full --csv kept-log.csv
expect 1 'No space left on device' compare good.toml -q --html /dev/full --json kept-compare.json
expect 1 'No space left on device' analyse good.csv -q --json /dev/full --csv kept-analyse.csv
expect 1 'No space left on device' paper -q --json /dev/full --csv kept-paper.csv
for kept in kept-log.csv kept-compare.json kept-analyse.csv kept-paper.csv; do
  [ -s $kept ] || fail "a full disk for one result cost $kept"
done
"$ftcs" compare good.toml > /dev/full 2> err
{ [ $? -eq 1 ] && grep -q 'cannot write to standard output' err; } || fail "a full standard output: $(cat err)"

mkdir tables
cp binary.toml tables/table2.toml
expect 1 'tables/table2.toml' paper -q --experiments tables
printf 'table = "table2"\ntitle = 3\n' > tables/table2.toml
expect 1 'tables/table2.toml:2:' paper -q --experiments tables
expect 1 'none' paper -q --experiments none

# Shards and their merge are the whole, to the byte.
"$ftcs" simulate good.toml -q --json whole.json || fail "a good scenario"
for i in 1 2 3; do
  "$ftcs" simulate good.toml -q --shard $i/3 --json part$i.json || fail "shard $i"
done
"$ftcs" simulate good.toml -q --merge part1.json part2.json part3.json --json merged.json || fail "merge"
cmp whole.json merged.json || fail "the merge of three shards differs from the whole"
"$ftcs" simulate good.toml -q --threads 1 --json again.json
cmp whole.json again.json || fail "one thread gives another result than several"

# Memory does not depend on the length of a run: a hundred times as many cycles, the same peak to 2 MiB.
peak_kib() {
  python3 -c 'import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)' "$ftcs" simulate "$1" -q --threads 1 --seeds 1
}
sed 's/cycles = 40/cycles = 1000/' good.toml > short.toml
sed 's/cycles = 40/cycles = 100000/' good.toml > long-run.toml
short=$(peak_kib short.toml)
long=$(peak_kib long-run.toml)
[ $((long - short)) -lt 2048 ] || fail "memory grows with the run: $short KiB for 1,000 cycles, $long KiB for 100,000"

# Waits until the program $1 has computed for a second or has ended: on a busy machine a second can pass before it
# computes at all.
computed() {
  local ticks
  for _ in $(seq 600); do
    ticks=$(awk '{ print $14 + $15 }' "/proc/$1/stat" 2> /dev/null) || return
    [ "${ticks:-0}" -ge 100 ] && return
    sleep 0.1
  done
}

# An interrupted sweep writes what it has.
sed 's/seeds = 5/seeds = 100000/' good.toml > long.toml
"$ftcs" simulate long.toml -q --json interrupted.json 2> err &
program=$!
computed $program
kill -INT $program
wait $program
[ $? -eq 1 ] || fail "an interrupted sweep must not succeed"
grep -q '"complete": false' interrupted.json || fail "an interrupted sweep says that it is incomplete"
grep -q '"seed": 1,' interrupted.json || fail "an interrupted sweep keeps its runs"

# What did not run to its end has missed nothing.
printf '[[limit]]\nservo = "adaptive"\nrms_time_error = { median = "0.001 ns" }\n' > limit
cat good.toml limit > done.toml
sed 's/seeds = 5/seeds = 20000/' good.toml | cat - limit > cut.toml
"$ftcs" simulate done.toml cut.toml cut.toml good.toml > out 2> err &
program=$!
computed $program
kill -INT $program
wait $program
[ $? -eq 1 ] || fail "an interrupted suite must not succeed"
grep -q 'interrupted; .*; of 4 scenarios, cut short: 1, not run: 2; these are not judged' err || fail "an interrupted suite: $(cat err)"
[ "$(grep -c '^MISSED' err)" -eq 1 ] && grep -q '^MISSED done' err || fail "only the first scenario was judged: $(cat err)"
[ "$(grep -c 'median over seeds' out)" -eq 2 ] || fail "a table of a scenario that did not run"

"$ftcs" paper -q --seeds 100000 --json interrupted-paper.json > out 2> err &
program=$!
computed $program
kill -INT $program
wait $program
[ $? -eq 1 ] || fail "an interrupted paper must not succeed"
[ "$(tail -n 1 out)" = "Interrupted: the demanded tolerances were not all judged." ] || fail "an interrupted paper says: $(cat out)"
grep -q '"complete": false' interrupted-paper.json || fail "an interrupted paper says that it is incomplete"
grep -q '"row": "FTCS1"' interrupted-paper.json || fail "an interrupted paper keeps its rows"

"$ftcs" compare --seeds 2 > out || fail "ftcs compare without arguments"
tail -n 4 out | grep -q '^bound' || fail "the bound is the last row"
"$ftcs" paper -q --json paper.json > out || fail "ftcs paper"
grep -q '"row": "FTCS1"' paper.json || fail "paper.json has its rows"

exit $((failures > 0))
