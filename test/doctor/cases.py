# SPDX-License-Identifier: MIT
"""Misconfigurations: name, who transmits ("raw": transmitter.py with these faults; "ptp4l": Debian's with these lines),
the receiver's flags, the cause that must be told and a part of the remedy. Further keys: prepare, a command in our namespace;
second, the faults of another transmitter beside the first."""


def case(name, by, faults, flags, cause, remedy, **more):
    return dict(name=name, by=by, faults=faults, flags=flags, cause=cause, remedy=remedy, **more)


CASES = [
    case("nobody transmits", None, [], [], "no_announce", "nothing of PTP is on this wire"),
    case("another domain", "ptp4l", ["domainNumber 5"], [], "domain", "--domainNumber 5"),
    case("another transportSpecific", "ptp4l", ["transportSpecific 3"], [], "sdo", "--transportSpecific 3"),
    case("802.1AS heard by IEEE 1588", "ptp4l", ["transportSpecific 1", "network_transport L2"], ["-2"], "sdo", "--preset gptp"),
    case("L2 heard by UDPv4", "ptp4l", ["network_transport L2"], [], "transport", "-2"),
    case("UDPv4 heard by L2", "ptp4l", [], ["-2"], "transport", "-4"),
    case("UDPv6 heard by UDPv4", "ptp4l", ["network_transport UDPv6"], [], "transport", "-6"),
    case("another Ethernet group", "ptp4l", ["network_transport L2", "ptp_dst_mac 01:80:C2:00:00:0E"], ["-2"], "group",
         "--ptp_dst_mac 01:80:C2:00:00:0E"),
    case("only receivers", "ptp4l", ["slaveOnly 1", "delay_mechanism P2P"], [], "only_receivers", "slaveOnly"),
    case("peer to peer heard end to end", "ptp4l", ["delay_mechanism P2P", "logMinPdelayReqInterval -3"], [], "other_mechanism",
         "-P"),
    case("end to end heard peer to peer", "ptp4l", [], ["-P"], "no_peer", "-E"),
    case("not in the list", "ptp4l", [], ["--acceptable-transmitter", "001122.fffe.334455"], "not_acceptable",
         "--acceptable-transmitter"),
    case("neighbour not 802.1AS capable", "ptp4l", ["transportSpecific 1", "network_transport L2", "delay_mechanism E2E",
         "ptp_dst_mac 01:80:C2:00:00:0E"], ["--preset", "gptp"], "no_peer", "asCapable"),
    case("neighborPropDelayThresh too small", "ptp4l",
         ["transportSpecific 1", "network_transport L2", "delay_mechanism P2P", "ptp_dst_mac 01:80:C2:00:00:0E",
          "logMinPdelayReqInterval -3", "neighborPropDelayThresh 20000000", "min_neighbor_prop_delay -20000000"],
         ["--preset", "gptp", "--neighborPropDelayThresh", "1", "--min_neighbor_prop_delay", "0", "--logMinPdelayReqInterval",
          "-3"], "peer_delay_limit", "--neighborPropDelayThresh"),
    case("a VLAN", "raw", ["vlan=7"], [], "vlan", "type vlan id 7"),
    case("PTP version 1", "raw", ["version=1"], [], "version", "do not understand each other"),
    case("rp_filter drops them", "raw", ["source=192.0.2.9"], [], "not_delivered", "rp_filter",
         prepare="for i in all default $INTERFACE; do sysctl -qw net.ipv4.conf.$i.rp_filter=1; done"),
    case("Sync without Announce", "raw", ["announce=0"], [], "sync_without_announce", "UDP port 320"),
    case("Announce without Sync", "raw", ["sync=0"], [], "no_sync", "not in the state MASTER"),
    case("Sync without Follow_Up", "raw", ["follow_up=0"], [], "no_follow_up", "no transmit timestamps"),
    case("no Delay_Resp", "raw", ["delay_resp=0"], [], "no_delay_resp", "do not reach the transmitter"),
    case("Delay_Resp to others", "raw", ["resp_to_others=1"], [], "delay_resp_for_others", "serves others alone"),
    case("two clocks with one identity", "raw", ["twins=1"], [], "two_transmitters", "clockIdentity"),
    case("two clocks with one identity at the same time", "raw", [], ["--first-step"], "two_transmitters", "end one of them",
         second=["ahead=37.002"]),
    case("two transmitters disagree", "raw", ["priority1=100"], ["--first-step"], "transmitters_disagree", "--acceptable-transmitter",
         second=["identity=0a0b0cfffe0102ff", "ahead=37.05"]),
    case("an asymmetric path", "raw", ["priority1=100"], ["--first-step"], "transmitters_disagree", "asymmetric by twice as much",
         second=["identity=0a0b0cfffe0102ff", "forward_wait=0.05", "domain=1"]),
    case("alternate transmitters alone", "raw", ["alternate=1"], [], "alternate", "transmitter's own settings"),
    case("255 steps from the grandmaster", "raw", ["steps_removed=255"], [], "unusable_announce", "--clockIdentity"),
    case("malformed", "raw", ["truncate=1"], [], "malformed", "the transmitter is at fault"),
    case("an arbitrary epoch", "raw", ["flags=0"], ["--clock", "system"], "timescale", "--allow-epoch"),
    case("a wrong UTC offset", "raw", ["utc_offset=0"], ["--clock", "system"], "timescale", "utc_offset 37"),
    case("UTC taken for TAI", "raw", ["ahead=0"], ["--clock", "system"], "timescale", "37 s ahead"),
    case("a reference in 1970", "raw", ["ahead=-1000000000"], ["--clock", "system"], "timescale", "--max-first-change"),
    case("37 s away, and no step", "raw", [], [], "first_offset", "--offset 37s"),
    case("the system clock is 5 s away, and no step", "raw", ["ahead=42"], ["--clock", "system"], "first_offset", "--first-step"),
    case("the link is down", None, [], [], "link_down", "ip link set", prepare="ip link set $INTERFACE down"),
    case("no such adapter clock", None, [], ["-H"], "other", "hardware"),
    case("a clock that the adapter does not have", "raw", [], ["--clock", "phc"], "other", "--clock system"),
]
# A receiver that nothing stands in the way of is locked: else the table above would show nothing.
GOOD = [case("Debian's ptp4l", "ptp4l", [], [], "locked", ""), case("frames of our own", "raw", [], ["--first-step"], "locked", ""),
        case("37 s away, where a virtual clock may begin", "raw", [], ["--offset", "37s"], "locked", ""),
        case("TAI for the system clock", "raw", [], ["--clock", "system"], "locked", ""),
        case("the system clock is 5 s away, and a step allowed", "raw", ["ahead=42"], ["--clock", "system", "--first-step"], "locked", ""),
        case("two transmitters agree", "ptp4l", [], [], "locked", "agree: they differ by",
             second=["domainNumber 1", "clockIdentity 0a0b0c.fffe.0102ff"])]
