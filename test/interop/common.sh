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
  # Addresses of IPv6 are usable at once: nobody else is there to have the same.
  ip netns exec "$ours" sysctl -qw "net.ipv6.conf.$our_interface.accept_dad=0" 2> /dev/null || true
  ip netns exec "$theirs" sysctl -qw "net.ipv6.conf.$their_interface.accept_dad=0" 2> /dev/null || true
  ip -n "$ours" link set "$our_interface" up
  ip -n "$theirs" link set "$their_interface" up
  our_mac=$(ip -n "$ours" -o link show "$our_interface" | sed -n 's/.*link\/ether \([0-9a-f:]*\).*/\1/p')
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
# linuxptp 3.1.1's spelling; later ones win. Its port goes to FAULTY when an answer to a Pdelay_Req comes just after it has
# changed its state ("rogue peer delay response"): for a quarter of a second instead of 16.
start_ptp4l() {
  local name=$1
  shift
  printf '%s\n' "[global]" "free_running 1" "time_stamping software" "network_transport UDPv4" \
    "delay_mechanism E2E" "twoStepFlag 1" "tx_timestamp_timeout 50" "logAnnounceInterval -1" \
    "fault_reset_interval -2" "uds_address $folder/$name.uds" "$@" > "$folder/$name.conf"
  ip netns exec "$theirs" ptp4l -f "$folder/$name.conf" -i "$their_interface" -m -q \
    > "$folder/$name.log" 2>&1 &
  pids+=($!)
}

start_capture() {
  # The part of tshark that captures, without the seconds that tshark takes to start.
  ip netns exec "$ours" dumpcap -q -i "$our_interface" -f "udp or ether proto 0x88f7" -w "$folder/capture.pcap" \
    > "$folder/dumpcap.log" 2>&1 &
  capture=$!
  pids+=("$capture")
  local i
  for i in $(seq 200); do  # until it captures
    [ -s "$folder/capture.pcap" ] && return
    sleep 0.1
  done
  fail "dumpcap captures nothing"
}

packets() {  # display filter: how many packets of ours match
  tshark -r "$folder/capture.pcap" -Y "eth.src == $our_mac && ($1)" 2> /dev/null | wc -l
}

# What a time receiver's log must show after a run of so many seconds at 8 Syncs a second.
check_receiver() {  # exit code, seconds
  local code=$1 duration=$2 samples median
  grep -v "master offset" "$folder/receiver.log" || true
  [ "$code" -eq 0 ] || fail "exit code $code: not locked"
  [ -s "$folder/errors.log" ] && fail "error lines"
  grep -qE "no transmit timestamp|FAULTY|no Sync|no good one" "$folder/receiver.log" && fail "fault lines"
  grep -qE "LISTENING to UNCALIBRATED on RS_SLAVE" "$folder/receiver.log" || fail "no transmitter selected"

  # Eight Syncs a second, less the start, which takes up to five seconds.
  samples=$(grep -c "master offset" "$folder/receiver.log" || true)
  [ "$samples" -ge $(((duration - 5) * 8 * 8 / 10)) ] || fail "only $samples samples in $duration s"
  # Far above what a loaded machine does to software stamps, far below where the clock started.
  median=$(sed -n 's/.*master offset *\(-\{0,1\}[0-9]*\) .*/\1/p' "$folder/receiver.log" \
    | tail -n $((samples / 2)) | tr -d - | sort -n | sed -n "$((samples / 4 + 1))p")
  [ "$median" -lt 50000 ] || fail "the median offset is $median ns"
  echo "$samples samples, median offset $median ns"
}

# Wireshark's opinion of every message that we sent.
check_capture() {
  kill -INT "$capture" 2> /dev/null || true
  wait "$capture" || true
  local sent decoded malformed
  sent=$(packets "udp.port == 319 || udp.port == 320 || eth.type == 0x88f7")
  decoded=$(packets "ptp.v2.versionptp == 2")
  malformed=$(packets "_ws.malformed || _ws.expert.severity >= 0x600000")
  echo "tshark: $sent messages of ours, $decoded decoded, $malformed malformed"
  [ "$sent" -gt 0 ] || fail "nothing of ours was captured"
  [ "$sent" -eq "$decoded" ] || fail "tshark does not understand every message"
  [ "$malformed" -eq 0 ] || fail "tshark calls messages malformed"
}

# The same profile for both ends: transport (UDPv4, UDPv6, L2) and mechanism (E2E, P2P, hybrid, gptp). Sets
# theirs_too, lines of ptp4l's configuration, and ours_too, flags of ours.
choose_profile() {
  local transport=$1 mechanism=$2
  case $mechanism in
    gptp)  # linuxptp's gPTP.cfg, but for the delay that software stamps see, more than 800 ns, and for the
           # patience with Sync: a busy machine holds up either process for longer than 375 ms
      theirs_too=("priority1 248" "priority2 248" "logAnnounceInterval 0" "syncReceiptTimeout 10"
        "neighborPropDelayThresh 20000000" "min_neighbor_prop_delay -20000000" "assume_two_step 1"
        "path_trace_enabled 1" "follow_up_info 1" "transportSpecific 0x1" "ptp_dst_mac 01:80:C2:00:00:0E"
        "network_transport L2" "delay_mechanism P2P")
      ours_too=(--preset gptp --neighborPropDelayThresh 20000000 --syncReceiptTimeout 10)
      return ;;
    hybrid)
      theirs_too=("hybrid_e2e 1") ours_too=(--hybrid_e2e 1) ;;
    *)
      theirs_too=("delay_mechanism $mechanism") ours_too=(--delay_mechanism "$mechanism") ;;
  esac
  theirs_too+=("network_transport $transport")
  ours_too+=(--network_transport "$transport" --logAnnounceInterval -1)
}
