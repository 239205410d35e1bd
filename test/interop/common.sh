# SPDX-License-Identifier: MIT
# For scripts that put this program and Debian's linuxptp at the two ends of a veth pair, each in a network
# namespace of its own. Source it, then call require and make_network. Nothing outside of the two namespaces is
# touched; they go with the script.

set -euo pipefail

skip() {
  echo "skipped: $*"
  exit 77  # SKIP_RETURN_CODE
}

fail() {
  echo "FAILED: $*"
  for log in "$folder"/*.log; do echo "--- $(basename "$log")"; tail -n 25 "$log"; done
  exit 1
}

require() {  # programs that must be there
  PATH=$PATH:/usr/sbin:/sbin
  [ "$(id -u)" -eq 0 ] || skip "needs root for network namespaces"
  local program
  for program in "$@"; do
    command -v "$program" > /dev/null || skip "needs $program"
  done
}

make_network() {
  ours=ftcs-a-$$ theirs=ftcs-b-$$
  our_interface=fa$$ their_interface=fb$$
  our_address=10.77.0.1
  folder=$(mktemp -d)
  pids=()
  trap remove_network EXIT
  ip netns add "$ours" || skip "may not make network namespaces"
  ip netns add "$theirs"
  # In a chroot or a container the namespace can be made and yet not be entered.
  ip netns exec "$ours" true 2> /dev/null || skip "may not enter network namespaces here"
  ip link add "$our_interface" netns "$ours" type veth peer name "$their_interface" netns "$theirs"
  ip -n "$ours" address add "$our_address/24" dev "$our_interface"
  ip -n "$theirs" address add 10.77.0.2/24 dev "$their_interface"
  ip -n "$ours" link set "$our_interface" up
  ip -n "$theirs" link set "$their_interface" up
}

remove_network() {
  local pid
  for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null || true; done
  wait 2> /dev/null || true
  ip netns delete "$ours" 2> /dev/null || true
  ip netns delete "$theirs" 2> /dev/null || true
  rm -rf "$folder"
}

# Debian's ptp4l at the other end, steering nothing (free_running): name of its log, lines of its configuration in
# linuxptp 3.1.1's spelling.
start_ptp4l() {
  local name=$1
  shift
  printf '%s\n' "[global]" "free_running 1" "time_stamping software" "network_transport UDPv4" \
    "delay_mechanism E2E" "twoStepFlag 1" "tx_timestamp_timeout 50" "logAnnounceInterval -1" \
    "uds_address $folder/$name.uds" "$@" > "$folder/$name.conf"
  ip netns exec "$theirs" ptp4l -f "$folder/$name.conf" -i "$their_interface" -m -q \
    > "$folder/$name.log" 2>&1 &
  pids+=($!)
}

start_capture() {
  ip netns exec "$ours" tshark -q -i "$our_interface" -f udp -w "$folder/capture.pcap" \
    > "$folder/tshark.log" 2>&1 &
  capture=$!
  pids+=("$capture")
  local i
  for i in $(seq 50); do  # until it captures
    [ -s "$folder/capture.pcap" ] && return
    sleep 0.1
  done
  fail "tshark captures nothing"
}

packets() {  # display filter: how many packets of ours match
  tshark -r "$folder/capture.pcap" -Y "ip.src == $our_address && ($1)" 2> /dev/null | wc -l
}

# Wireshark's opinion of every message that we sent.
check_capture() {
  kill -INT "$capture" 2> /dev/null || true
  wait "$capture" || true
  local sent decoded malformed
  sent=$(packets "udp.port == 319 || udp.port == 320")
  decoded=$(packets "ptp.v2.versionptp == 2")
  malformed=$(packets "_ws.malformed || _ws.expert.severity >= 0x600000")
  echo "tshark: $sent messages of ours, $decoded decoded, $malformed malformed"
  [ "$sent" -gt 0 ] || fail "nothing of ours was captured"
  [ "$sent" -eq "$decoded" ] || fail "tshark does not understand every message"
  [ "$malformed" -eq 0 ] || fail "tshark calls messages malformed"
}
