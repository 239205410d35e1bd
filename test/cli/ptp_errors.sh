#!/bin/bash
# SPDX-License-Identifier: MIT
# What a user gets wrong, the program says in one line on standard error, with an exit code of its own: 2 for
# flags and files, 1 for what the system refuses.
set -uo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
folder=$(mktemp -d)
holder=
cleanup() {
  [ -n "$holder" ] && kill "$holder" 2> /dev/null
  rm -rf "$folder"
}
trap cleanup EXIT
failures=0

expect() {  # exit code, text that the one line must hold, arguments...
  local code=$1 text=$2 result
  shift 2
  timeout 20 "$ftcs" "$@" > "$folder/out" 2> "$folder/err"
  result=$?
  if [ "$result" -ne "$code" ] || [ "$(wc -l < "$folder/err")" -ne 1 ] || ! grep -qF -- "$text" "$folder/err"; then
    echo "FAILED: ftcs $*: exit code $result, expected $code and one line with '$text'; got:"
    cat "$folder/err"
    failures=$((failures + 1))
  fi
}

config() { printf '%s\n' "$@" > "$folder/ptp.conf"; }

expect 2 "unknown command 'follow'" follow
expect 2 "unknown command 'ptp4l'; did you mean 'ptp'?" ptp4l -i lo
expect 2 "unknown command 'phc2sys'; did you mean 'phc'?" phc2sys -a -r
expect 2 "unknown command 'statu'; did you mean 'status'?" statu
expect 2 "unknown command 'statu'; did you mean 'status'?" help statu
expect 2 "subcommand is required"
expect 2 "unknown option '--bogus' (see" ptp --bogus
expect 2 "unknown option '--domain'; did you mean '--domainNumber'?" ptp -i lo --domain 3
expect 2 "unknown option '--Delay-mechanism'; did you mean '--delay_mechanism'?" ptp -i lo --Delay-mechanism=E2E
expect 2 "unexpected argument 'eth0'" ptp -i lo eth0
expect 2 "(see ftcs ptp --help)" ptp --bogus
expect 2 "no interface" ptp
expect 2 "only one port" ptp -i lo -i eth0
expect 2 "expected virtual, system, phc, /dev/ptpN or auto" ptp -i lo --clock realtime
expect 2 "only of the virtual clock" ptp -i lo --clock auto --skew 1ppm
expect 2 "a time transmitter steers no clock" ptp -i lo --clock auto --role time-transmitter
expect 2 "--preset: unknown preset 'telecom' (known: default-e2e, default-p2p, gptp)" ptp -i lo --preset telecom
expect 2 "--acceptable-transmitter: 'me': expected 001122.fffe.334455" ptp -i lo --acceptable-transmitter me
expect 2 "'fe80::1' is not an IPv4 address" ptp -i lo --unicast fe80::1
expect 2 "'10.0.0.1' is not an IPv6 address" ptp -i lo -6 --unicast 10.0.0.1
expect 2 "'10.0.0.1' is not an Ethernet address" ptp -i lo -2 --unicast 10.0.0.1
expect 2 "exclude each other" ptp -i lo --hybrid_e2e 1 --unicast 10.0.0.1
expect 2 "ptp_dst_mac: '01:02': expected 01:1B:19:00:00:00" ptp -i lo --ptp_dst_mac 01:02
expect 2 "unknown servo 'magic'" ptp -i lo --servo magic
expect 2 "offset gain must lie between 0 and 1" ptp -i lo --servo ftcs --offset-gain 2
expect 2 "is no band" ptp -i lo --servo ftcs --converged-band 5us:1us
expect 2 "--offset-gain is of the servo ftcs, this one is adaptive: add --servo ftcs" ptp -i lo --offset-gain 0.5
expect 2 "'1' is no time" ptp -i lo --offset 1
expect 2 "'50' is no rate" ptp -i lo --skew 50
expect 2 "--max-frequency: -1000 ppb: expected 1 to 9e+08 ppb" ptp -i lo --max-frequency -1ppm
expect 2 "--max_frequency: '100ppm': expected a plain number, without a unit" ptp -i lo --max_frequency 100ppm
expect 2 "--pi_integral_const: '-1': expected a plain number, 0 or more" ptp -i lo --pi_integral_const -1
expect 2 "--max-frequency-change: '1' is no rate" ptp -i lo --max-frequency-change 1
expect 2 "--max-frequency-change: -1000 ppb: expected 0 to 9e+08 ppb" ptp -i lo --max-frequency-change -1ppm
expect 2 "--frequency-granularity: 200000000 ppb: expected 0 to 1e+08 ppb" ptp -i lo --frequency-granularity 200000ppm
expect 2 "--timer-granularity: 2000000000 ns: expected 0 to 1e+09 ns" ptp -i lo --timer-granularity 2s
expect 2 "steering_latency: -1 ns: expected 0 to 1e+09 ns" ptp -i lo --steering_latency -1
expect 2 "max_frequency_change: the servo linuxptp-pi cannot keep to it" ptp -i lo --max-frequency-change 1ppm --servo linuxptp-pi
expect 2 "coarser than max_frequency" ptp -i lo --max-frequency 10ppb --frequency-granularity 20ppb
expect 2 "--never-step and --first-step exclude each other" ptp -i lo --never-step --first-step
expect 2 "not an IPv4 address" ptp -i lo --unicast somewhere
expect 2 "must differ" ptp -i lo --event-port 4000 --general-port 4000
expect 2 "--role" ptp -i lo --role grandmaster
expect 2 "-s asks for a time receiver" ptp -i lo -s --role time-transmitter
expect 2 "-s asks for a time receiver, --masterOnly" ptp -i lo -s --masterOnly 1
expect 2 "boundary_clock_jbod: '1' is not supported, only 0" ptp -i lo --boundary_clock_jbod 1
expect 1 "interface nosuch0" ptp -i nosuch0 --boundary_clock_jbod 0 --twoStepFlag 1 --G.8275.portDS.localPriority 128
expect 2 "domainNumber: '256': expected an integer from 0 to 255" ptp -i lo --domainNumber 256
expect 2 "'DeviceNet' is not supported, only UDPv4, UDPv6 and L2" ptp -i lo --network_transport DeviceNet
expect 2 "excludes" ptp -i lo -H -S
expect 2 "$folder/none.conf: No such file" ptp -f "$folder/none.conf"

expect 2 "$folder: Is a directory" ptp -i lo -f "$folder"
expect 2 "--duration: 'nan': expected a number" ptp -i lo --duration nan
expect 2 "--event-port: '0': expected an integer" ptp -i lo --event-port 0
expect 2 "--general-port: '65536': expected an integer" ptp -i lo --general-port 65536
expect 2 "--duration: 'nan': expected a number from 3 to 86400" demo --duration nan
expect 2 "--logSyncInterval: '1': expected an integer from -7 to 0" demo --logSyncInterval 1

config "[global]" "domainNumber 0" "colour blue"
expect 2 "ptp.conf:3: unknown setting 'colour'" ptp -i lo -f "$folder/ptp.conf"
config "[global]" "delayMechanism E2E"
expect 2 "ptp.conf:2: unknown setting 'delayMechanism'; did you mean 'delay_mechanism'?" ptp -i lo -f "$folder/ptp.conf"
config "[global]" "" "# a comment" "delay_mechanism Auto"
expect 2 "ptp.conf:4: delay_mechanism: 'Auto' is not supported, only E2E and P2P" ptp -i lo -f "$folder/ptp.conf"
config "[global]" "max_frequency_change 1e10"
expect 2 "ptp.conf:2: max_frequency_change: 1e+10 ppb: expected 0 to 9e+08 ppb" ptp -i lo -f "$folder/ptp.conf"
config "[global]" "timer_granularity 1000" "clock_servo pi"
expect 2 "timer_granularity: the servo linuxptp-pi cannot keep to it" ptp -i lo -f "$folder/ptp.conf"
config "[global]" "logSyncInterval zero"
expect 2 "ptp.conf:2: logSyncInterval" ptp -i lo -f "$folder/ptp.conf"
config "domainNumber 0"
expect 2 "ptp.conf:1: a setting before the first section" ptp -i lo -f "$folder/ptp.conf"
config "[eth0]" "[eth1]"
expect 2 "ptp.conf:2: a second interface 'eth1'" ptp -f "$folder/ptp.conf"
config "[unicast_master_table]"
expect 2 "ptp.conf:1: section 'unicast_master_table' is not supported" ptp -i lo -f "$folder/ptp.conf"

expect 1 "interface nosuch0: no such device" ptp -i nosuch0
expect 1 "hardware time stamping on lo" ptp -i lo -H
expect 1 "; -S takes software ones" ptp -i lo -H

# Sockets and sources.
expect 1 "socket $folder/none/ftcs: No such file" ptp -i lo --event-port 20319 --general-port 20320 --uds_address "$folder/none/ftcs"
expect 1 "socket $folder/none: No such file" status -s "$folder/none"
expect 1 "already in use" ptp -i lo --event-port 20319 --general-port 20320 --uds_address "$folder/out"
expect 2 "--source" ptp --source chrony
expect 2 "only a time receiver" ptp --source ptp4l --role time-transmitter
expect 1 "socket $folder/none/monitor: No such file" ptp --source ptp4l --slave_event_monitor "$folder/none/monitor" -S
expect 2 "--ntp-shm: '256': expected an integer" ptp -i lo --ntp-shm 256
expect 2 "follows nobody" ptp -i lo --role time-transmitter --chrony-sock "$folder/chrony"
expect 2 "two programs would steer" ptp -i lo --clock system --chrony-sock "$folder/chrony"

# Ctrl-C while somebody who never answers is asked: nothing is left behind.
mkdir "$folder/tmp"
python3 -c 'import socket, sys, time
s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM); s.bind(sys.argv[1]); time.sleep(20)' "$folder/deaf" &
holder=$!
for _ in $(seq 50); do [ -S "$folder/deaf" ] && break; sleep 0.1; done
for command in "status -s $folder/deaf" "ptp --source ptp4l --ptp4l-socket $folder/deaf --slave_event_monitor $folder/monitor"; do
  # shellcheck disable=SC2086
  TMPDIR=$folder/tmp timeout --foreground -s INT 0.4 "$ftcs" $command > "$folder/out" 2> "$folder/err"
  if [ -n "$(ls "$folder/tmp")" ] || [ -s "$folder/err" ]; then
    echo "FAILED: ftcs $command, ended by Ctrl-C, left $(ls "$folder/tmp") and said: $(cat "$folder/err")"
    failures=$((failures + 1))
  fi
done
kill "$holder"

# A port that another program holds: a unicast port belongs to one.
ports=(--event-port $((20000 + $$ % 6000)) --general-port $((26000 + $$ % 6000)))
"$ftcs" ptp -i lo "${ports[@]}" --unicast 127.0.0.1 > /dev/null 2>&1 &
holder=$!
sleep 0.5
expect 1 "already in use by another program" ptp -i lo "${ports[@]}" --unicast 127.0.0.1
expect 1 "already in use by another program" demo --event-port "${ports[1]}"
expect 1 "already in use by another program" demo --event-port $((ports[3] - 1))
kill -TERM "$holder"
wait "$holder"
code=$?
if [ "$code" -ne 3 ]; then
  echo "FAILED: SIGTERM: exit code $code, expected 3 (stopped, not locked)"
  failures=$((failures + 1))
fi
holder=

# Nobody there: the last lines say where was listened.
"$ftcs" ptp -i lo "${ports[@]}" --domainNumber 7 -P --duration 0.3 > "$folder/out"
for text in "not locked: no Announce yet after 0.3 s on lo, domain 7, UDPv4, transportSpecific 0" "no peer delay: the neighbour"; do
  grep -qF "$text" "$folder/out" && continue
  echo "FAILED: nobody there, expected '$text'; got:"
  cat "$folder/out"
  failures=$((failures + 1))
done

# A file written for ptp4l names its servo, as Debian's does: that is followed, and said.
config "[global]" "clock_servo pi"
for servo in "" "--servo adaptive"; do
  # shellcheck disable=SC2086
  "$ftcs" ptp -i lo "${ports[@]}" -f "$folder/ptp.conf" $servo --duration 0.1 > "$folder/out"
  if grep -q "clock_servo pi: the servo is linuxptp-pi" "$folder/out"; then said=yes; else said=; fi
  [ -z "$servo" ] && [ -n "$said" ] && continue
  [ -n "$servo" ] && [ -z "$said" ] && continue
  echo "FAILED: clock_servo pi $servo says:"
  cat "$folder/out"
  failures=$((failures + 1))
done

# And already a while after the start: five Announce intervals. The file is emptied first: what an earlier run said
# there must not be taken for what this one says, which would end it before it began.
: > "$folder/out"
"$ftcs" ptp -i lo "${ports[@]}" --logAnnounceInterval -3 --uds_address none > "$folder/out" &
holder=$!
for _ in $(seq 50); do grep -q "no time transmitter was heard" "$folder/out" && break; sleep 0.1; done
grep -q "no time transmitter was heard" "$folder/out" || {
  echo "FAILED: nobody there for five Announce intervals, and no word of it:"
  cat "$folder/out"
  failures=$((failures + 1))
}
kill -TERM "$holder"
wait "$holder"
holder=

# What could not be written is an error, whatever was measured.
if [ -w /dev/full ]; then
  for arguments in "ptp --help" "ptp -i lo ${ports[*]} --duration 0.1 --csv" "demo --duration 3"; do
    # shellcheck disable=SC2086
    timeout 20 "$ftcs" $arguments > /dev/full 2> "$folder/err"
    code=$?
    if [ "$code" -ne 1 ] || ! grep -q "standard output" "$folder/err"; then
      echo "FAILED: ftcs $arguments > /dev/full: exit code $code, expected 1:"
      cat "$folder/err"
      failures=$((failures + 1))
    fi
  done
fi

# Ctrl-C at a terminal reaches every process of a group: still a demonstration that was stopped, and not a
# transmitter that died.
setsid --wait timeout --signal=INT 2 "$ftcs" demo > "$folder/out" 2> "$folder/err"
if grep -q "transmitter ended" "$folder/err" || ! grep -q "stopped after" "$folder/err" || ! grep -q "^ftcs " "$folder/out"; then
  echo "FAILED: an interrupted demonstration says:"
  cat "$folder/out" "$folder/err"
  failures=$((failures + 1))
fi

# Ports below 1024 without the right to them (where nobody needs a right, there is nothing to see).
privileged=$(cat /proc/sys/net/ipv4/ip_unprivileged_port_start 2> /dev/null || echo 1024)
if [ "$(id -u)" -eq 0 ] && [ "$privileged" -gt 320 ] && command -v setpriv > /dev/null; then
  cp "$ftcs" "$folder/ftcs" && chmod 755 "$folder" "$folder/ftcs"
  timeout 20 setpriv --reuid=65534 --clear-groups --bounding-set=-all --inh-caps=-all \
    "$folder/ftcs" ptp -i lo > "$folder/out" 2> "$folder/err"
  code=$?
  if [ "$code" -ne 1 ] || ! grep -qF "UDP port 319 (below 1024): not permitted" "$folder/err"; then
    echo "FAILED: port 319 as nobody: exit code $code:"
    cat "$folder/err"
    failures=$((failures + 1))
  fi
fi

[ "$failures" -eq 0 ] && echo "all errors are as documented"
exit "$failures"
