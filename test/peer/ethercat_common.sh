# SPDX-License-Identifier: MIT
# For scripts that put a foreign EtherCAT program at one end of a veth pair and ours at the other, each in a network
# namespace of its own. Source it, then call make_segment_network. What is foreign comes from a path in the environment.

set -uo pipefail

skip() {
  echo "skipped: $*"
  exit 77  # SKIP_RETURN_CODE
}

failures=0
fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

finish() {
  [ "$failures" -eq 0 ] || { echo "$failures failures"; exit 1; }
  echo "all as expected"
}

make_segment_network() {  # programs that must be there
  PATH=$PATH:/usr/sbin:/sbin
  [ "$(id -u)" -eq 0 ] || skip "needs root for network namespaces"
  local program
  for program in ip python3 "$@"; do
    command -v "$program" > /dev/null || skip "needs $program"
  done
  here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
  folder=$(mktemp -d)
  main_side=ftcs-pm$$ segment_side=ftcs-ps$$
  segment_pid='' capture_pid=''
  trap remove_segment_network EXIT
  ip netns add "$main_side" 2> /dev/null && ip netns add "$segment_side" || skip "may not make network namespaces"
  ip netns exec "$main_side" true 2> /dev/null || skip "may not enter network namespaces here"
  ip link add ev0 netns "$main_side" type veth peer name ev1 netns "$segment_side" || skip "no veth"
  local side
  for side in "$main_side" "$segment_side"; do
    ip netns exec "$side" sysctl -qw net.ipv6.conf.all.disable_ipv6=1
  done
  ip -n "$main_side" link set ev0 up
  ip -n "$segment_side" link set ev1 up
}

remove_segment_network() {
  [ -n "$capture_pid" ] && kill "$capture_pid" 2> /dev/null
  [ -n "$segment_pid" ] && kill "$segment_pid" 2> /dev/null
  wait 2> /dev/null
  ip netns del "$main_side" 2> /dev/null
  ip netns del "$segment_side" 2> /dev/null
  rm -rf "$folder"
}

# Runs a program at the MainDevice's side for at most so many seconds, then interrupts it.
at_main() {
  local seconds=$1
  shift
  ip netns exec "$main_side" timeout -k 5 -s INT "$seconds" "$@" < /dev/null
}

# Our segment, or another program at its side; stops the one before.
start_segment() {
  stop_segment
  ip netns exec "$segment_side" "$@" < /dev/null > "$folder/segment.log" 2>&1 &
  segment_pid=$!
  sleep 1
  kill -0 "$segment_pid" 2> /dev/null || { cat "$folder/segment.log"; fail "the segment did not start: $*"; }
}

stop_segment() {
  [ -n "$segment_pid" ] || return 0
  kill "$segment_pid" 2> /dev/null
  wait "$segment_pid" 2> /dev/null
  segment_pid=''
}

start_capture() {  # name
  capture=$folder/$1.pcap
  rm -f "$capture"
  ip netns exec "$main_side" tshark -q -i ev0 -F pcap -w "$capture" < /dev/null > "$folder/capture.log" 2>&1 &
  capture_pid=$!
  local i
  for i in $(seq 100); do
    [ -s "$capture" ] && return
    sleep 0.1
  done
  fail "tshark captures nothing"
}

stop_capture() {
  [ -n "$capture_pid" ] || return 0
  sleep 0.5
  kill -INT "$capture_pid" 2> /dev/null
  wait "$capture_pid" 2> /dev/null
  capture_pid=''
}

# Wireshark's opinion of every frame of the last capture: no error, and no warning but that on SOEM's source address, which is
# a group address.
check_capture() {  # name
  stop_capture
  local frames decoded wrong
  frames=$(tshark -r "$capture" -T fields -e frame.number -Y "eth.type == 0x88a4" 2> /dev/null | wc -l)
  decoded=$(tshark -r "$capture" -T fields -e frame.number -Y "ecat" 2> /dev/null | wc -l)
  wrong=$(tshark -r "$capture" -T fields -e frame.number \
    -Y "_ws.malformed || _ws.expert.severity >= 0x800000 || (_ws.expert.severity >= 0x600000 && !eth.src_not_group)" \
    2> /dev/null | wc -l)
  echo "tshark, $1: $frames EtherCAT frames, $decoded decoded, $wrong malformed or in error"
  [ "$frames" -gt 0 ] || fail "$1: nothing was captured"
  [ "$frames" -eq "$decoded" ] || fail "$1: tshark does not decode every frame"
  [ "$wrong" -eq 0 ] || fail "$1: tshark reports errors"
}

# Where the drives of our segment ended, by its own summary (printed when it stops). A MainDevice that is interrupted leaves
# drives that were in OP to their watchdogs: SAFEOP 0x001B.
check_drives() {  # state, AL status code, how many
  stop_segment
  local there
  there=$(grep -cE "^drive +[0-9]+ +$1 +$2" "$folder/segment.log")
  if [ "$there" -ne "$3" ]; then
    cat "$folder/segment.log"
    fail "$there of $3 drives ended in $1 with AL status code $2"
  else
    echo "segment: $3 drives ended in $1, AL status code $2"
  fi
}
