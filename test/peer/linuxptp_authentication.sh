#!/bin/bash
# SPDX-License-Identifier: MIT
# Authentication (IEEE 1588-2019, 16.14) both ways against ptp4l 4.3 or later, which Debian 12 does not have: what is
# accepted, what is dropped, and how it is counted.
#
# test/peer/linuxptp_authentication.sh [build/ftcs]
# Skipped (77) where newer_linuxptp.sh has none.
. "$(dirname "$0")/../interop/common.sh"
ftcs=$(realpath "${1:-build/ftcs}")
require ip python3
newer=$("$(dirname "$0")/newer_linuxptp.sh") || skip "no newer ptp4l"
make_network
echo "ptp4l $("$newer" -v), $("$ftcs" --version)"

first="1 SHA256-128 HEX:F8ADC6B8B8E9AA709106BA42481EC9E29607334DE2C3C737A11A12931DB27F8C"
second="2 SHA256 32 HEX:EE91D469B3A8ADC6AC8EB28E21794C706E08FDE48863828A7B0281AFCA81B17D"
third="3 AES128 HEX:FAF48EBA01E7C5966A76CB787AED4E7B"
fourth="4 AES256 B64:PKTF9VQz94qPaoAzW4eE3JtFoQ8Ov1OTQSojalWyMbs="
keys() {  # file, lines
  local file=$folder/$1
  shift
  printf '%s\n' "[security_association]" "spp 1" "$@" > "$file.new"
  chmod 600 "$file.new"
  mv "$file.new" "$file"
}

start_newer() {  # name, key file or none, active key, lines of its configuration
  local name=$1 file=$2 key=$3
  shift 3
  printf '%s\n' "[global]" "free_running 1" "time_stamping software" "tx_timestamp_timeout 50" "logAnnounceInterval -1" \
    "logSyncInterval -3" "logMinDelayReqInterval -3" "uds_address $folder/$name.uds" "uds_ro_address $folder/$name.ro" \
    "$@" > "$folder/$name.conf"
  if [ "$file" != none ]; then
    printf '%s\n' "sa_file $folder/$file" "[$their_interface]" "spp 1" "active_key_id $key" >> "$folder/$name.conf"
  fi
  ip netns exec "$theirs" "$newer" -f "$folder/$name.conf" -i "$their_interface" -m -q > "$folder/$name.log" 2>&1 &
  newer_pid=$!
  pids+=("$newer_pid")
}

stop_newer() {
  kill "$newer_pid"
  wait "$newer_pid" 2> /dev/null || true
}

follow() {  # name, seconds, flags
  local name=$1 seconds=$2
  shift 2
  ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" -S --uds_address none --offset 1ms --logAnnounceInterval -1 \
    --duration "$seconds" "$@" > "$folder/$name.log" 2>&1
}

counted() {  # log, counter
  sed -n "s/.*counted besides:.*[ ,]$2 \([0-9]*\).*/\1/p" "$folder/$1.log" | tail -n 1 | grep . || echo 0
}

row() { printf '%-58s %-12s %s\n' "$1" "$2" "$(sed -n 's/.*counted besides: //p' "$folder/$3.log" | tail -n 1 |
  tr ',' '\n' | grep -E 'authentication|replayed' | tr '\n' ',' | sed 's/^ //; s/,$//')"; }

accepted() {  # what, log, exit code
  [ "$3" -eq 0 ] || fail "$1: not locked"
  row "$1" locked "$2"
}

refused() {  # what, log, exit code, counter, words of the sentence
  [ "$3" -eq 3 ] || fail "$1: exit code $3, expected 3"
  [ "$(counted "$2" "$4")" -gt 0 ] || fail "$1: $4 is not counted"
  grep -q "$5" "$folder/$2.log" || fail "$1: the log does not say: $5"
  row "$1" "not locked" "$2"
}

keys shared "$first" "$second" "$third" "$fourth"
keys other "1 SHA256-128 another" "2 SHA256 another" "3 AES128 anotheranotheran"
keys one "$first"

printf '%-58s %-12s %s\n' "ours follows ptp4l" result counted
for key in 1 2 3 4; do
  start_newer "shared$key" shared "$key"
  code=0
  follow "follow$key" 8 --sa_file "$folder/shared" --spp 1 --active_key_id $((5 - key)) || code=$?
  accepted "it sends by key $key, ours by key $((5 - key))" "follow$key" "$code"
  stop_newer
done

start_newer transmitter shared 2
code=0
follow wrong 5 --sa_file "$folder/other" --spp 1 --active_key_id 1 || code=$?
refused "another key under the same number" wrong "$code" authentication_wrong_code "not authentic"
code=0
follow unknown 5 --sa_file "$folder/one" --spp 1 --active_key_id 1 || code=$?
refused "a key that ours does not have" unknown "$code" authentication_unknown_key "not authentic"
code=0
follow keyless 7 || code=$?
[ "$code" -eq 3 ] || fail "ptp4l answers who has no keys"
grep -q "or authentication (--spp)" "$folder/keyless.log" || fail "ours without keys is not told why nobody answers"
row "ours has no keys: ptp4l answers no request" "not locked" keyless
stop_newer

start_newer plain none 0
code=0
follow missing 5 --sa_file "$folder/shared" --spp 1 --active_key_id 1 || code=$?
refused "ptp4l has no keys" missing "$code" authentication_missing "not authentic"
stop_newer

# Everything that the transmitter sends comes again two seconds later.
start_newer replayed shared 1
ip netns exec "$theirs" python3 "$(dirname "$0")/../hostile/replay.py" "$their_interface" 10.77.0.2 2 &
pids+=($!)
replay=$!
code=0
follow replays 12 --sa_file "$folder/shared" --spp 1 --active_key_id 1 || code=$?
kill "$replay"
accepted "each message comes again after 2 s" replays "$code"
[ "$(counted replays replayed)" -gt 20 ] || fail "replayed messages are not counted"
stop_newer

# Key 5 is new: first to ours, then the transmitter sends by it, then the old ones go.
keys rotating "$first"
start_newer before rotating 1
follow rotation 22 --sa_file "$folder/rotating" --spp 1 --active_key_id 1 &
rotation=$!
pids+=("$rotation")
program() { pgrep -P "$1" | head -n 1; }  # of a function in the background
sleep 7
keys rotating "$first" "5 SHA256 new"
kill -HUP "$(program "$rotation")"
sleep 1
stop_newer
start_newer after rotating 5
sleep 6
keys rotating "1 SHA256 nobody" "5 SHA256 new"
kill -HUP "$(program "$rotation")"
code=0
wait "$rotation" || code=$?
grep -q "2 keys, sends by key 1" "$folder/rotation.log" || fail "the keys are not read again"
accepted "a new key, read again on SIGHUP, then the old one is gone" rotation "$code"
stop_newer

transmit() {  # name, file, key
  ip netns exec "$ours" "$ftcs" ptp -i "$our_interface" -S --role time-transmitter --uds_address none --logSyncInterval -3 \
    --logAnnounceInterval -1 --logMinDelayReqInterval -3 --duration 9 --sa_file "$folder/$2" --spp 1 \
    --active_key_id "$3" > "$folder/$1.log" 2>&1 &
  our_pid=$!
  pids+=("$our_pid")
}

printf '\n%-58s %-12s %s\n' "ptp4l follows ours" result counted
for key in 1 2 3 4; do
  transmit "transmit$key" shared "$key"
  start_newer "follower$key" shared $((5 - key)) "clientOnly 1" "summary_interval 0"
  wait "$our_pid" || fail "our transmitter failed"
  grep -q "UNCALIBRATED on RS_SLAVE" "$folder/follower$key.log" || fail "ptp4l does not select ours with key $key"
  grep -qE "path delay +[0-9]+" "$folder/follower$key.log" || fail "ptp4l measures no delay with key $key"
  row "ours sends by key $key, ptp4l by key $((5 - key))" measured "transmit$key"
  stop_newer
done
transmit stranger other 1
start_newer follower shared 1 "clientOnly 1" "summary_interval 0"
wait "$our_pid" || fail "our transmitter failed"
grep -q "RS_SLAVE" "$folder/follower.log" && fail "ptp4l follows ours by another key"
row "another key under the same number" "not followed" stranger
stop_newer
