# SPDX-License-Identifier: MIT
# What every job has at hand. Port I (device vptpI, clock /dev/ptpI) lies in the network namespace nI; ports 0 and 1 are the two
# ends of a link, 2 and 3 of the next. Errors that a job judges are the true ones, from the module.
# shellcheck disable=SC2034

debug=/sys/kernel/debug/vptp
failures=0
transmitter=

# at PORT COMMAND...: in the port's namespace (a program, so that it can be ended by its process number)

load() {  # parameters of the module
  insmod /modules/vptp.ko seed="${SEED:-1}" "$@" || exit 1
  local device i
  for device in /sys/class/net/vptp*; do
    i=${device##*vptp}
    ip netns add "n$i"
    ip link set "vptp$i" netns "n$i"
    at "$i" sysctl -qw "net.ipv6.conf.vptp$i.accept_dad=0"
    ip -n "n$i" address add "10.9.$((i / 2)).$((i + 1))/24" dev "vptp$i"
    ip -n "n$i" link set lo up
    ip -n "n$i" link set "vptp$i" up
  done
  sleep 1
}

unload() {
  local name
  for name in $(ip netns list | cut -d' ' -f1); do ip netns del "$name"; done
  sleep 0.5
  rmmod vptp
}

given() {  # PORT NAME VALUE: see vptp/README.md
  echo "$3" > "$debug/$1/$2"
}

# The system clock has its own rate, and all hardware clocks show its time at theirs; the second oscillator is 20 ppm fast, its clock 300 us ahead.
start_over() {  # [ppt of oscillator 1] [ns of clock 1]
  local i
  witness system reset
  for i in /dev/ptp*; do
    phc_ctl -q "$i" freq 0 set > /dev/null 2>&1
    given "${i#/dev/ptp}" osc_ppt 0
  done
  given 1 osc_ppt "${1:-20000000}"
  given 1 jump_ns "${2:-300000}"
}

# ptp4l on port 0; returns when it transmits.
transmit() {  # flags
  : > transmitter.log
  at 0 chrt -f 20 ptp4l -f "${CONFIG:-/guest/ptp4l.cfg}" --uds_address=/run/transmitter -i vptp0 -m -q "$@" > transmitter.log 2>&1 &
  transmitter=$!
  until_says transmitter.log "to MASTER\|to GRAND_MASTER\|assuming the grand"
  sleep 1
}

busy() {  # PROCESSES SECONDS
  local i
  for i in $(seq "$1"); do witness busy "$2" & done
}

stop_transmitter() {
  [ -n "$transmitter" ] || return 0
  kill "$transmitter" 2> /dev/null
  wait "$transmitter" 2> /dev/null
  transmitter=
}

until_says() {  # FILE PATTERN [SECONDS]
  local i
  for i in $(seq $((${3:-15} * 20))); do
    grep -q "$2" "$1" && return 0
    sleep 0.05
  done
  fail "$1 does not say '$2' within ${3:-15} s"
  return 1
}

# Runs a command for some seconds, then ends it by SIGINT; NAME.truth has the truth, NAME.log what it said, $code its exit code. Of ftcs ptp,
# NAME.stated has each line of its --csv beside the truth.
follow() {  # NAME SECONDS COMMAND...
  local name=$1 length=$2
  shift 2
  start_follow "$name" "$length" "$@"
  sleep "$length"
  end_follow
}

start_follow() {  # NAME SECONDS COMMAND...
  following=$1 annotator=
  chrt -f 30 witness truth "$2" "${INTERVAL:-0.05}" > "$1.truth" &
  truth_log=$!
  if [[ " ${*:3} " == *" ftcs ptp "* ]]; then
    rm -f stated.pipe
    mkfifo stated.pipe
    chrt -f 30 witness annotate < stated.pipe > "$1.stated" &
    annotator=$!
    "${@:3}" --csv > stated.pipe 2> "$1.log" &
  else
    "${@:3}" > "$1.log" 2>&1 &
  fi
  follower=$!
}

end_follow() {
  kill -INT "$follower" 2> /dev/null
  wait "$follower"
  code=$?
  wait "$truth_log"
  [ -z "$annotator" ] || wait "$annotator"
}

# What happened, as one line of the report; the table is made of these. A limit that does not hold is a failure. What ours stated of its own error
# is judged with it: 99 of 100 within three times the deviation, from 5 s on, or $STATED_FROM.
judge() {  # NAME A-B [limit=V ...]
  local answer
  if answer=$(witness judge "$1.truth" "${@:2}" 2>&1); then
    echo "ok      $1:$answer" | tee "$1.judged"
  else
    echo "FAILED  $1:$answer" | tee "$1.judged"
    failures=$((failures + 1))
  fi
  if [ -s "$1.stated" ] && [ -z "$UNSEEN" ] && [ ! -e "$1.stated.judged" ]; then
    touch "$1.stated.judged"
    # shellcheck disable=SC2046
    judge_stated "$1" "$2" "from=${STATED_FROM:-5}" share=99 $(printf '%s\n' "${@:3}" | grep "^target=")
  fi
}

# Set by a job in which the error of the path that no message shows, an asymmetry, is greater than what is stated.
UNSEEN=

judge_stated() {  # NAME A-B [share=PERCENT] [from=S]
  local answer
  if answer=$(witness sigma "$1.stated" "${@:2}" 2>&1); then
    echo "ok      $1:$answer"
  else
    fail "$1:$answer"
  fi
}

sd_of() {
  sed -n 's/.* sd=\([0-9.]*\).*/\1/p' "$1.judged"
}

rms_of() {
  sed -n 's/.* rms=\([0-9.]*\).*/\1/p' "$1.judged"
}

below() {  # NAME OTHER: of two that were judged, the RMS of the first is not the greater one
  check "$1 is not above $2: $(rms_of "$1") and $(rms_of "$2") ns" \
    awk "BEGIN { exit !($(rms_of "$1") <= $(rms_of "$2")) }"
}

fail() {
  failures=$((failures + 1))
  echo "FAILED  $*"
}

check() {  # SENTENCE COMMAND...: the command succeeds
  if "${@:2}"; then echo "ok      $1"; else fail "$1"; fi
}

check_not() {
  if "${@:2}"; then fail "$1"; else echo "ok      $1"; fi
}

check_code() {  # NAME EXPECTED
  if [ "$code" -eq "$2" ]; then
    echo "ok      $1: exit code $code"
  else
    fail "$1: exit code $code, expected $2"
    tail -n 6 "$1.log"
  fi
}

says() {  # FILE PATTERN
  grep -q -- "$2" "$1"
}

times_said() {  # FILE PATTERN
  grep -c -- "$2" "$1" || true
}

stat_of() {  # PORT NAME: a counter of the module
  sed -n "s/^phc$1 .* $2 \(-\{0,1\}[0-9]*\).*/\1/p" "$debug/stat"
}

finish() {
  stop_transmitter
  [ "$failures" -eq 0 ] || echo "$failures failures"
  exit $((failures > 0))
}
