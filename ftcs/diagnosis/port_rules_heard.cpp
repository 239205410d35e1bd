// SPDX-License-Identifier: MIT
//
// Why no time transmitter is selected.
#include <array>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "ftcs/diagnosis/port_rules.h"

namespace ftcs::diagnosis {
namespace {

using ptp::Counter;
using ptp::MessageType;
using Found = std::optional<Finding>;

std::string who(const Talker& talker) {
  return fmt::format("the transmitter {}", to_text(talker.port).view());
}

/// A transmitter of version 2, on the wire or at the port, of whom that is true.
template <class Predicate>
const Talker* transmitter(const PortSeen& seen, const Predicate& is) {
  const auto wanted = [&is](const Talker& talker) {
    return talker.version == ptp::kVersion && talker.transmits() && is(talker);
  };
  const Talker* found = seen.at_port.find(wanted);
  if (found == nullptr && seen.on_wire) found = seen.on_wire->find(wanted);
  return found;
}

bool same_way(const Talker& talker, const PortSettings& settings) {
  return talker.way == settings.way && talker.vlan == 0;
}

Found not_acceptable(const PortSeen& seen) {
  const std::uint64_t count = seen.counters[Counter::kUnacceptableTransmitter];
  if (count == 0) return std::nullopt;
  const Talker* const one = transmitter(seen, [&](const Talker& talker) {
    return is_for(talker, seen.settings) && talker.announces();
  });
  const std::string identity =
      one != nullptr ? std::string(to_text(one->port.clock).view()) : "IDENTITY";
  return Finding{Cause::kNotAcceptable,
                 fmt::format("{} Announces of {} dropped, which is not in the list of acceptable "
                             "transmitters",
                             count, identity),
                 "a transmitter of that list", "--acceptable-transmitter " + identity + " adds it"};
}

Found not_authentic(const PortSeen& seen) {
  const ptp::Counters& count = seen.counters;
  const std::uint64_t missing = count[Counter::kAuthenticationMissing];
  const std::uint64_t unknown = count[Counter::kAuthenticationUnknownKey];
  const std::uint64_t wrong =
      count[Counter::kAuthenticationWrongCode] + count[Counter::kAuthenticationUnsupported];
  if (missing + unknown + wrong == 0) return std::nullopt;
  std::string remedy =
      "spp, active_key_id and the keys of sa_file must be those of the transmitter";
  if (unknown + wrong == 0)
    remedy = "sa_file, spp and active_key_id at the transmitter, or none here";
  return Finding{
      Cause::kNotAuthentic,
      fmt::format("messages are dropped, as they are not authentic: {} without authentication, {} "
                  "by a key that is not in sa_file, {} with a wrong code",
                  missing, unknown, wrong),
      "an AUTHENTICATION TLV by a key of this port's association", remedy};
}

Found not_capable(const PortSeen& seen) {
  if (seen.counters[Counter::kNotCapable] == 0) return std::nullopt;
  const PortSettings& settings = seen.settings;
  const std::string dropped =
      fmt::format("the neighbour is not 802.1AS capable (asCapable false, {} messages dropped): ",
                  seen.counters[Counter::kNotCapable]);
  if (seen.counters[Counter::kSeveralResponders] > 0) {
    return Finding{Cause::kSeveralPeers, dropped + "two ports answer one Pdelay_Req",
                   "a cable between two ports, or a switch that speaks 802.1AS",
                   "-E measures through switches; --asCapable true asks nothing of the neighbour"};
  }
  if (seen.peer_delay) {
    const double delay = seen.peer_delay->ns();
    const bool above = *seen.peer_delay > Duration{settings.highest_peer_delay};
    const bool below = *seen.peer_delay < Duration{settings.lowest_peer_delay};
    if (above || below) {
      return Finding{Cause::kPeerDelayLimit,
                     dropped + fmt::format("the link delay is {:.0f} ns", delay),
                     fmt::format("{} to {} ns", settings.lowest_peer_delay.count(),
                                 settings.highest_peer_delay.count()),
                     fmt::format("{} {:.0f} allows it, if the cable or software stamps explain it",
                                 above ? "--neighborPropDelayThresh" : "--min_neighbor_prop_delay",
                                 above ? 2.0 * delay : -2.0 * std::abs(delay))};
    }
  }
  return Finding{Cause::kNoPeer,
                 dropped + fmt::format("{} Pdelay_Req sent, {} answered",
                                       seen.counters[Counter::kPdelayReqSent],
                                       seen.counters[Counter::kPdelayRespReceived]),
                 "a neighbour that answers each Pdelay_Req",
                 "-P at the neighbour, or -E here; --asCapable true asks nothing of it"};
}

Found unusable_announce(const PortSeen& seen) {
  if (seen.counters[Counter::kUnusableAnnounce] == 0) return std::nullopt;
  return Finding{
      Cause::kUnusableAnnounce,
      fmt::format("{} Announces that cannot be followed: a clock that claims this port's "
                  "identity, or 255 steps from its grandmaster",
                  seen.counters[Counter::kUnusableAnnounce]),
      "a transmitter with an identity of its own", "--clockIdentity gives this port another one"};
}

Found alternate(const PortSeen& seen) {
  if (seen.counters[Counter::kAlternateTransmitter] == 0) return std::nullopt;
  return Finding{Cause::kAlternate, "only alternate transmitters are heard (alternateMasterFlag)",
                 "a transmitter in the state MASTER", "the transmitter's own settings"};
}

Found domain(const PortSeen& seen) {
  const PortSettings& settings = seen.settings;
  const Talker* const one = transmitter(seen, [&](const Talker& talker) {
    return same_way(talker, settings) && talker.domain != settings.domain &&
           talker.major_sdo_id == settings.major_sdo_id;
  });
  if (one == nullptr) return std::nullopt;
  return Finding{Cause::kDomain, fmt::format("{} is in domain {}", who(*one), one->domain),
                 fmt::format("domain {}", settings.domain),
                 fmt::format("--domainNumber {}", one->domain)};
}

Found sdo(const PortSeen& seen) {
  const PortSettings& settings = seen.settings;
  const Talker* const one = transmitter(seen, [&](const Talker& talker) {
    return same_way(talker, settings) && talker.major_sdo_id != settings.major_sdo_id;
  });
  if (one == nullptr) return std::nullopt;
  return Finding{
      Cause::kSdo,
      fmt::format("{} has majorSdoId (transportSpecific) {}{}", who(*one), one->major_sdo_id,
                  one->domain != settings.domain ? fmt::format(", domain {}", one->domain) : ""),
      fmt::format("majorSdoId {}", settings.major_sdo_id),
      one->major_sdo_id == 1 ? std::string("--preset gptp for IEEE 802.1AS")
                             : fmt::format("--transportSpecific {}", one->major_sdo_id)};
}

Found version(const PortSeen& seen) {
  const auto old = [](const Talker& talker) { return talker.version < ptp::kVersion; };
  const Talker* one = seen.at_port.find(old);
  if (one == nullptr && seen.on_wire) one = seen.on_wire->find(old);
  if (one == nullptr) return std::nullopt;
  return Finding{
      Cause::kVersion,
      fmt::format("the transmitter speaks PTP version {} (IEEE 1588-2002)", one->version),
      "version 2 (IEEE 1588-2008 and later)",
      "the transmitter's own settings: the two versions do not understand each other"};
}

Found unicast(const PortSeen& seen) {
  const bool on_wire = transmitter(seen, [&](const Talker& talker) {
                         return is_for(talker, seen.settings) && !talker.to_group;
                       }) != nullptr;
  if (seen.settings.unicast || (seen.unicast_dropped == 0 && !on_wire)) return std::nullopt;
  return Finding{Cause::kUnicast, "PTP messages come to this host's own address",
                 "multicast, which alone is listened to", "--unicast ADDRESS of the transmitter"};
}

Found multicast(const PortSeen& seen) {
  if (!seen.settings.unicast) return std::nullopt;
  const auto ours = [&](const Talker& talker) { return is_for(talker, seen.settings); };
  const Talker* const one =
      transmitter(seen, [&](const Talker& talker) { return ours(talker) && talker.to_group; });
  const bool is_served = transmitter(seen, [&](const Talker& talker) {
                           return ours(talker) && !talker.to_group;
                         }) != nullptr;
  if (one == nullptr || is_served) return std::nullopt;
  return Finding{Cause::kMulticast, fmt::format("{} sends to the multicast group", who(*one)),
                 "messages to this host's own address, as --unicast has it",
                 "leave --unicast out, or set the transmitter to unicast"};
}

Found vlan(const PortSeen& seen) {
  const Talker* const one =
      transmitter(seen, [](const Talker& talker) { return talker.vlan != 0; });
  if (one == nullptr) return std::nullopt;
  const std::string& interface = seen.settings.interface;
  return Finding{Cause::kVlan, fmt::format("{} is heard in VLAN {} alone", who(*one), one->vlan),
                 "untagged messages",
                 fmt::format("ip link add link {0} name {0}.{1} type vlan id {1}; then -i {0}.{1}",
                             interface, one->vlan)};
}

Found transport(const PortSeen& seen) {
  const Talker* const one = transmitter(seen, [&](const Talker& talker) {
    return talker.way != seen.settings.way && talker.vlan == 0;
  });
  if (one == nullptr) return std::nullopt;
  return Finding{Cause::kTransport, fmt::format("{} speaks {}", who(*one), name(one->way)),
                 name(seen.settings.way),
                 fmt::format("{}{}", flag(one->way),
                             one->domain != seen.settings.domain
                                 ? fmt::format(" --domainNumber {}", one->domain)
                                 : "")};
}

Found not_delivered(const PortSeen& seen) {
  if (!seen.on_wire || seen.link != Link::kUp || multicast(seen)) return std::nullopt;
  const auto ours = [&](const Talker& talker) {
    return is_for(talker, seen.settings) && talker.announces();
  };
  const Talker* const one = seen.on_wire->find(ours);
  if (one == nullptr || seen.at_port.find(ours) != nullptr) return std::nullopt;
  return Finding{
      Cause::kNotDelivered,
      fmt::format("{} is on the wire, but its messages do not reach this port's socket", who(*one)),
      "them at UDP ports 319 and 320",
      "a firewall (nft list ruleset) or rp_filter drops them: "
      "sysctl net.ipv4.conf.all.rp_filter, net.ipv4.conf." +
          seen.settings.interface + ".rp_filter"};
}

Found malformed(const PortSeen& seen) {
  std::uint64_t count = 0;
  for (const Counter counter : {Counter::kTruncated, Counter::kUnknownType, Counter::kWrongLength,
                                Counter::kBadTimestamp, Counter::kMalformedTlv}) {
    count += seen.counters[counter];
  }
  if (count == 0) return std::nullopt;
  return Finding{Cause::kMalformed,
                 fmt::format("{} malformed messages and no usable Announce", count),
                 "messages as IEEE 1588 has them", "the transmitter is at fault"};
}

/// An Announce may not have had its turn yet: nobody is to blame.
bool is_early(const PortSeen& seen) {
  constexpr double kLeastS = 2.0;
  constexpr double kIntervals = 3.0;
  return seen.seconds < std::fmax(kLeastS, kIntervals * seen.settings.announce_interval_s);
}

Found sync_without_announce(const PortSeen& seen) {
  if (is_early(seen)) return std::nullopt;
  const Talker* const one = transmitter(seen, [&](const Talker& talker) {
    return is_for(talker, seen.settings) && talker.count(MessageType::kSync) > 0;
  });
  if (one == nullptr || one->announces()) return std::nullopt;
  return Finding{Cause::kSyncWithoutAnnounce,
                 fmt::format("{} sends Sync and no Announce", who(*one)), "an Announce",
                 "its general messages (UDP port 320) are lost or filtered, or it is a port of the "
                 "automotive profile, which announces nothing"};
}

Found only_receivers(const PortSeen& seen) {
  if (is_early(seen)) return std::nullopt;
  const auto asks = [&](const Talker& talker) {
    return is_for(talker, seen.settings) && !talker.transmits();
  };
  const bool heard =
      seen.at_port.find(asks) != nullptr || (seen.on_wire && seen.on_wire->find(asks) != nullptr);
  if (!heard) return std::nullopt;
  return Finding{Cause::kOnlyReceivers, "other ports ask for time and nobody announces any",
                 "an Announce", "start the transmitter, or take slaveOnly from one of the others"};
}

Found no_announce(const PortSeen& seen) {
  const PortSettings& settings = seen.settings;
  const std::string where =
      fmt::format("on {}, domain {}, {}, transportSpecific {}", settings.interface, settings.domain,
                  name(settings.way), settings.major_sdo_id);
  if (is_early(seen)) {
    return Finding{Cause::kNoAnnounce,
                   fmt::format("no Announce yet after {:.1f} s {}", seen.seconds, where),
                   fmt::format("one every {:g} s", settings.announce_interval_s), ""};
  }
  return Finding{
      Cause::kNoAnnounce, "no time transmitter was heard " + where,
      "an Announce every second or two",
      seen.on_wire
          ? std::string("nothing of PTP is on this wire: the transmitter is off, on another "
                        "network or VLAN, or a switch keeps multicast back (IGMP snooping)")
          : fmt::format("ftcs doctor -i {} looks at the whole wire", settings.interface)};
}

}  // namespace

std::string name(Way way) {
  constexpr std::array<const char*, 3> kNames{"UDPv4", "UDPv6", "L2"};
  return kNames[static_cast<std::size_t>(way)];
}

std::string flag(Way way) {
  constexpr std::array<const char*, 3> kFlags{"-4", "-6", "-2"};
  return kFlags[static_cast<std::size_t>(way)];
}

bool is_for(const Talker& talker, const PortSettings& settings) noexcept {
  return talker.version == ptp::kVersion && same_way(talker, settings) &&
         talker.domain == settings.domain && talker.major_sdo_id == settings.major_sdo_id;
}

std::span<const PortRule> rules_of_hearing() noexcept {
  static constexpr std::array<PortRule, 16> kRules{
      not_acceptable,
      not_authentic,
      not_capable,
      unusable_announce,
      alternate,
      unicast,
      multicast,
      not_delivered,
      sync_without_announce,
      domain,
      sdo,
      transport,
      vlan,
      version,
      malformed,
      only_receivers,
  };
  return kRules;
}

std::optional<Finding> other_group(const PortSeen& seen) {
  const PortSettings& settings = seen.settings;
  if (settings.way != Way::kEthernet || !seen.on_wire) return std::nullopt;
  const Talker* const one = transmitter(seen, [&](const Talker& talker) {
    return is_for(talker, settings) && talker.to_group && talker.destination != settings.group &&
           talker.destination != std::array<std::uint8_t, 6>{};
  });
  if (one == nullptr) return std::nullopt;
  const std::string group = fmt::format("{:02X}", fmt::join(one->destination, ":"));
  return Finding{Cause::kGroup, fmt::format("{} sends to the group {}", who(*one), group),
                 fmt::format("the group {:02X}", fmt::join(settings.group, ":")),
                 "--ptp_dst_mac " + group};
}

Finding nothing_heard(const PortSeen& seen) { return *no_announce(seen); }

}  // namespace ftcs::diagnosis
