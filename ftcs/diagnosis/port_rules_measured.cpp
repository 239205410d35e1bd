// SPDX-License-Identifier: MIT
//
// Why a clock is not locked though a time transmitter is selected.
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "ftcs/diagnosis/port_rules.h"

namespace ftcs::diagnosis {
namespace {

using ptp::Counter;
using ptp::MessageType;
using Found = std::optional<Finding>;

const Talker* announcer(const PortSeen& seen) {
  return seen.at_port.find(
      [&](const Talker& talker) { return is_for(talker, seen.settings) && talker.announces(); });
}

std::string who(const PortSeen& seen) {
  const Talker* const one = announcer(seen);
  return one == nullptr ? std::string("the transmitter")
                        : fmt::format("the transmitter {}", to_text(one->port).view());
}

Found no_receive_stamps(const PortSeen& seen) {
  if (seen.receive_stamps_missing == 0 || seen.counters[Counter::kForwardPairs] > 0) {
    return std::nullopt;
  }
  return Finding{
      Cause::kNoReceiveStamps,
      fmt::format("{} Syncs came without a receive timestamp", seen.receive_stamps_missing),
      "a timestamp of the kernel with each",
      "-S takes software timestamps; ethtool -T " + seen.settings.interface +
          " shows what the adapter can"};
}

Found no_sync(const PortSeen& seen) {
  if (seen.counters[Counter::kSyncReceived] > 0) return std::nullopt;
  const auto syncs = [&](const Talker& talker) {
    return is_for(talker, seen.settings) && talker.count(MessageType::kSync) > 0;
  };
  const bool on_wire = seen.on_wire && seen.on_wire->find(syncs) != nullptr;
  return Finding{Cause::kNoSync,
                 fmt::format("{} announces, but no Sync {}", who(seen),
                             on_wire ? "reaches this port, though they are on the wire" : "comes"),
                 "a Sync (UDP port 319 or IEEE 802.3)",
                 on_wire ? "a firewall drops UDP port 319: nft list ruleset"
                         : "the transmitter is not in the state MASTER, or port 319 is filtered on "
                           "the way"};
}

Found no_follow_up(const PortSeen& seen) {
  const ptp::Counters& count = seen.counters;
  if (count[Counter::kForwardPairs] > 0 || count[Counter::kFollowUpReceived] > 0) {
    return std::nullopt;
  }
  const Talker* const one = seen.at_port.find([&](const Talker& talker) {
    return is_for(talker, seen.settings) && talker.count(MessageType::kSync) > 0;
  });
  if (one == nullptr || !one->two_step) return std::nullopt;
  return Finding{
      Cause::kNoFollowUp,
      fmt::format("{} Syncs of two steps and no Follow_Up", count[Counter::kSyncReceived]),
      "a Follow_Up after each",
      "the transmitter has no transmit timestamps (look at its log), or UDP port 320 is "
      "filtered"};
}

Found two_transmitters(const PortSeen& seen) {
  const ptp::Counters& count = seen.counters;
  const std::uint64_t restarts =
      count[Counter::kSequenceRestarts] + count[Counter::kReferenceJumps];
  const std::uint64_t changes = count[Counter::kTransmitterChanges];
  constexpr std::uint64_t kOften = 3;  // a restart or a change of grandmaster makes one
  if (restarts < kOften && changes < kOften) return std::nullopt;
  return Finding{
      Cause::kTwoTransmitters,
      changes >= kOften
          ? fmt::format("the best transmitter changed {} times in {:.0f} s", changes, seen.seconds)
          : fmt::format("{} leaps of sequence or time in {:.0f} s: two transmitters have one "
                        "identity, {}",
                        restarts, seen.seconds, who(seen)),
      "one transmitter in the domain",
      "give one of them another clockIdentity, domain or priority1; --acceptable-transmitter "
      "chooses"};
}

Found timescale(const PortSeen& seen) {
  if (seen.refusal.empty()) return std::nullopt;
  return Finding{Cause::kTimescale, seen.refusal, "", ""};
}

Finding too_far(Duration offset, const PortSeen& seen) {
  const bool is_virtual = seen.clock.empty();
  // UTC is behind TAI by 37 s since 2017; a clock that is set is within a second of one of them.
  const bool on_utc = std::abs(offset.seconds() + 37.0) < 1.0;
  return Finding{
      Cause::kFirstOffset,
      fmt::format(
          "{} is {:+.3f} s from the reference, and without a step no more than 1 s is removed",
          is_virtual ? "the virtual clock" : seen.clock, offset.seconds()),
      "a clock near the reference at the start",
      !is_virtual ? "--first-step allows one step, or set the clock before"
      : on_utc ? "--first-step allows one step; --offset 37s begins on TAI, where the reference is"
               : "--first-step allows one step"};
}

Found first_offset(const PortSeen& seen) {
  return seen.samples.refused > 0 ? Found(too_far(seen.servo.offset, seen)) : std::nullopt;
}

Found no_transmit_stamps(const PortSeen& seen) {
  const std::uint64_t missing = seen.counters[Counter::kMissingTransmitStamp];
  if (seen.path_delay_known || missing == 0) return std::nullopt;
  return Finding{
      Cause::kNoTransmitStamps,
      fmt::format("no path delay was measured: {} requests left without a transmit timestamp",
                  missing),
      "a timestamp within tx_timestamp_timeout",
      "--tx_timestamp_timeout 100 waits longer; -S takes software timestamps; ethtool -T " +
          seen.settings.interface + " shows what the adapter can"};
}

Found no_delay_answer(const PortSeen& seen) {
  const ptp::Counters& count = seen.counters;
  if (seen.settings.peer_to_peer || seen.path_delay_known || count[Counter::kDelayReqSent] == 0 ||
      count[Counter::kDelayRespReceived] > 0) {
    return std::nullopt;
  }
  const std::string asked =
      fmt::format("no path delay was measured: {} Delay_Req sent, none answered",
                  count[Counter::kDelayReqSent]);
  if (seen.at_port.find([](const Talker& talker) {
        return talker.count(MessageType::kPdelayReq) > 0;
      }) != nullptr) {
    return Finding{Cause::kOtherMechanism, asked + "; Pdelay_Req are heard",
                   "Delay_Resp, which a transmitter that measures peer to peer does not send",
                   "-P"};
  }
  if (count[Counter::kWrongRequestingPort] + count[Counter::kStaleDelayResp] > 0) {
    return Finding{Cause::kDelayRespForOthers, asked + "; Delay_Resp to other ports are heard",
                   "a Delay_Resp to this port",
                   "the transmitter does not hear this port, or serves others alone"};
  }
  return Finding{
      Cause::kNoDelayResp, asked, "a Delay_Resp to each",
      "the requests do not reach the transmitter (firewall, UDP port 319, multicast), or "
      "it wants another transport or mechanism (-P, --hybrid_e2e 1) or authentication (--spp)"};
}

Found samples_refused(const PortSeen& seen) {
  const DisciplineCounters& count = seen.samples;
  const std::uint64_t refused = count.rejected + count.implausible + count.duplicate;
  constexpr std::uint64_t kFew = 4;
  if (refused < kFew || refused < count.used) return std::nullopt;
  return Finding{
      Cause::kSamplesRefused,
      fmt::format("{} of {} samples were turned away ({} outliers, {} implausible, {} "
                  "duplicates)",
                  refused, refused + count.used, count.rejected, count.implausible,
                  count.duplicate),
      "samples that agree with each other",
      "look at the network's load and at the transmitter; ftcs status lists the last ones"};
}

}  // namespace

std::optional<Finding> other_steers(const PortSeen& seen) {
  if (seen.foreign_changes == 0) return std::nullopt;
  return Finding{
      Cause::kOtherSteers,
      fmt::format("another program changed {} {} times in {:.0f} s",
                  seen.clock.empty() ? "the steered clock" : seen.clock, seen.foreign_changes,
                  seen.seconds),
      "one program that steers it",
      "stop the other (systemctl stop chrony systemd-timesyncd ntpsec phc2sys), or feed it "
      "with --chrony-sock",
      seen.locked};
}

/// Ids that had come before, with another time or too long ago for a copy. One restart makes a few.
std::optional<Finding> one_identity(const PortSeen& seen) {
  const ptp::Counters& count = seen.counters;
  const std::uint64_t repeated =
      count[Counter::kStaleSync] + count[Counter::kContradictingFollowUp];
  constexpr std::uint64_t kFew = 8;
  if (repeated < kFew || 4 * repeated < count[Counter::kForwardPairs]) return std::nullopt;
  return Finding{Cause::kTwoTransmitters,
                 fmt::format("{} Syncs in {:.0f} s repeat the sequenceId of others with another "
                             "time: two transmitters have one identity, {}",
                             repeated, seen.seconds, who(seen)),
                 "one transmitter of each identity",
                 "end one of them, or give it another clockIdentity", seen.locked};
}

std::optional<Finding> far_at_start(const PortSeen& seen) {
  return seen.first_offset ? Found(too_far(*seen.first_offset, seen)) : std::nullopt;
}

std::optional<Finding> no_peer(const PortSeen& seen) {
  if (!seen.settings.peer_to_peer || seen.peer_delay) return std::nullopt;
  if (seen.counters[Counter::kMissingTransmitStamp] > 0 &&
      seen.counters[Counter::kPdelayRespReceived] > 0) {
    return std::nullopt;
  }
  if (seen.counters[Counter::kSeveralResponders] > 0) {
    return Finding{Cause::kSeveralPeers, "two ports answer one Pdelay_Req",
                   "a cable between two ports, or a switch that measures peer to peer",
                   "-E measures through switches"};
  }
  return Finding{Cause::kNoPeer,
                 fmt::format("no peer delay: the neighbour answers no Pdelay_Req ({} sent)",
                             seen.counters[Counter::kPdelayReqSent]),
                 "a Pdelay_Resp to each", "-E, as the transmitter seems to measure end to end"};
}

std::span<const PortRule> rules_of_measuring() noexcept {
  static constexpr std::array<PortRule, 12> kRules{
      no_receive_stamps, no_sync,      no_follow_up, two_transmitters,
      one_identity,      timescale,    no_peer,      no_transmit_stamps,
      no_delay_answer,   first_offset, other_steers, samples_refused,
  };
  return kRules;
}

}  // namespace ftcs::diagnosis
