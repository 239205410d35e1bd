#!/bin/bash
# SPDX-License-Identifier: MIT
# What the system and the wire refuse, between two network namespaces: an interface that is down, one without a carrier, no right to
# raw sockets, foreign and malformed frames on the line. Each has its error, or does no harm. Skipped (77) without root.
set -uo pipefail

ftcs=$(realpath "${1:-build/ftcs}")
if [ "$(id -u)" -ne 0 ]; then echo "skipped: needs root for network namespaces"; exit 77; fi
for program in ip setpriv python3; do
  command -v $program > /dev/null || { echo "skipped: needs $program"; exit 77; }
done
folder=$(mktemp -d)
chmod 755 "$folder"
main=ftcs-em$$
segment=ftcs-es$$
pids=()
cleanup() {
  for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null; done
  wait 2> /dev/null
  ip netns del "$main" 2> /dev/null
  ip netns del "$segment" 2> /dev/null
  rm -rf "$folder"
}
trap cleanup EXIT
fail() {
  echo "FAILED: $*"
  for log in "$folder"/*.log; do echo "--- $(basename "$log")"; tail -n 10 "$log"; done
  exit 1
}
inside() { ip netns exec "$main" "$@"; }

ip netns add "$main" && ip netns add "$segment" || { echo "skipped: no network namespaces"; exit 77; }
inside true 2> /dev/null || { echo "skipped: may not enter network namespaces here"; exit 77; }
ip link add ev0 netns "$main" type veth peer name ev1 netns "$segment" || { echo "skipped: no veth"; exit 77; }

inside "$ftcs" ethercat scan -i ev0 > "$folder/down.log" 2>&1
[ $? -eq 1 ] && grep -q "interface ev0.*down" "$folder/down.log" || fail "interface down"
ip -n "$main" link set ev0 up
inside "$ftcs" ethercat scan -i ev0 > "$folder/carrier.log" 2>&1
[ $? -eq 1 ] && grep -q "no carrier on interface ev0" "$folder/carrier.log" || fail "no carrier"
ip -n "$segment" link set ev1 up

cp "$ftcs" "$folder/ftcs" && chmod 755 "$folder/ftcs"
inside setpriv --reuid=65534 --clear-groups --bounding-set=-all --inh-caps=-all \
  "$folder/ftcs" ethercat scan -i ev0 > "$folder/permission.log" 2>&1
[ $? -eq 1 ] && grep -q "raw socket.*not permitted" "$folder/permission.log" || fail "no permission"
inside "$ftcs" ethercat scan -i ev0 > "$folder/nobody.log" 2>&1
[ $? -eq 1 ] && grep -q "no reply" "$folder/nobody.log" || fail "nobody on the wire"

# Rubbish from the segment's side: other protocols, EtherCAT frames cut short, lengths beyond the end, network variables.
cat > "$folder/rubbish.py" << 'PY'
import random, socket, struct, sys, time
line = socket.socket(socket.AF_PACKET, socket.SOCK_RAW)
line.bind((sys.argv[1], 0))
random.seed(1)
head = b"\xff" * 6 + b"\x02\x00\x00\x00\x00\x09"
while True:
    payload = random.randbytes(random.randrange(1, 200))
    kind = random.randrange(4)
    ether_type = 0x0800 if kind == 0 else 0x88A4
    if kind == 1:
        payload = struct.pack("<H", 0x17FF) + payload  # a length beyond the end
    if kind == 2:
        payload = struct.pack("<H", 0x4000 | len(payload)) + payload  # network variables
    line.send(head + struct.pack(">H", ether_type) + payload)
    time.sleep(0.0005)
PY
ip netns exec "$segment" "$ftcs" ethercat-segment -i ev1 --drives 4 > "$folder/segment.log" 2>&1 &
pids+=($!)
ip netns exec "$segment" python3 "$folder/rubbish.py" ev1 > "$folder/rubbish.log" 2>&1 &
pids+=($!)
sleep 1
inside "$ftcs" ethercat scan -i ev0 > "$folder/scan.log" 2>&1 || fail "scan among foreign and malformed frames"
[ "$(grep -c "modelled servo drive" "$folder/scan.log")" -eq 4 ] || fail "scan: expected four drives"
inside "$ftcs" ethercat run -i ev0 --drives 4 --cycle 4ms --gate 2ms --sync-interval 200ms --drift-pulses 200 --duration 3 -q \
  --json "$folder/run.json" > "$folder/run.log" 2>&1
code=$?
[ $code -eq 0 ] || [ $code -eq 3 ] || fail "run among foreign and malformed frames: exit code $code"
grep -q '"op_cycle": [0-9]' "$folder/run.json" || fail "run: the drives did not reach OP"
echo "ok"
