// SPDX-License-Identifier: MIT
//
// Each cause from what a port would have seen; test/doctor makes them on a real network.
#include "ftcs/diagnosis/port_diagnosis.h"

#include <functional>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/wire/codec.h"

namespace ftcs::diagnosis {
namespace {

using ptp::Counter;

struct Said {
  std::uint8_t domain = 0;
  std::uint8_t sdo = 0;
  bool two_step = false;
  std::uint8_t version = 2;
};

template <class Body>
std::vector<std::uint8_t> message(const Body& body, const Said& said = {}) {
  ptp::Message message;
  message.header.domain = said.domain;
  message.header.major_sdo_id = said.sdo;
  if (said.two_step) message.header.flags = ptp::flag::kTwoStep;
  message.header.source = {ptp::ClockIdentity{{0xA, 0xB, 0xC, 0xFF, 0xFE, 1, 2, 3}}, 1};
  message.body = body;
  const auto bytes = ptp::encode(message);
  const auto view = bytes->view();
  std::vector<std::uint8_t> octets(view.begin(), view.end());
  octets[1] = static_cast<std::uint8_t>((octets[1] & 0xF0U) | said.version);
  return octets;
}

PortSeen fresh() {
  PortSeen seen;
  seen.settings.interface = "eth0";
  seen.seconds = 8.0;
  return seen;
}
/// A transmitter announces and its Syncs come.
PortSeen followed() {
  PortSeen seen = fresh();
  seen.has_transmitter = true;
  seen.at_port.on_message(message(ptp::Announce{}), Way::kUdpIpv4);
  seen.counters.add(Counter::kSyncReceived, 8);
  seen.counters.add(Counter::kForwardPairs, 8);
  return seen;
}

struct Case {
  Cause cause;
  PortSeen seen;
  const char* remedy;  ///< a part of the sentence
};

PortSeen with(PortSeen seen, const std::function<void(PortSeen&)>& change) {
  change(seen);
  return seen;
}

std::vector<Case> heard() {
  const auto say = [](const Said& said) {
    return [said](PortSeen& seen) {
      seen.at_port.on_message(message(ptp::Announce{}, said), Way::kUdpIpv4);
    };
  };
  return {
      {Cause::kNoAnnounce, fresh(), "ftcs doctor -i eth0"},
      {Cause::kLinkDown, with(fresh(), [](PortSeen& s) { s.link = Link::kDown; }),
       "ip link set eth0"},
      {Cause::kLinkDown, with(fresh(), [](PortSeen& s) { s.link = Link::kNoCarrier; }),
       "the cable"},
      {Cause::kLinkDown, with(fresh(), [](PortSeen& s) { s.link = Link::kGone; }), "plug it in"},
      {Cause::kNoAddress, with(fresh(), [](PortSeen& s) { s.link = Link::kNoAddress; }),
       "eth0 has no IPv4 address; expected one, as UDPv4 is spoken; ip address add ADDRESS/24 dev "
       "eth0 or DHCP; or -2 for Ethernet, -6 for IPv6"},
      {Cause::kOther,
       with(fresh(),
            [](PortSeen& s) {
              s.link = Link::kClosed;
              s.closed = "UDP port 319: in use";
            }),
       "UDP port 319: in use"},
      {Cause::kDomain, with(fresh(), say({.domain = 5})), "--domainNumber 5"},
      {Cause::kSdo, with(fresh(), say({.sdo = 1})), "--preset gptp"},
      {Cause::kSdo, with(fresh(), say({.sdo = 3})), "--transportSpecific 3"},
      {Cause::kVersion, with(fresh(), say({.version = 1})), "version 1"},
      {Cause::kTransport,
       with(fresh(),
            [](PortSeen& s) {
              s.on_wire.emplace();
              s.on_wire->on_message(message(ptp::Announce{}), Way::kEthernet);
            }),
       "; -2"},
      {Cause::kNotDelivered,
       with(fresh(),
            [](PortSeen& s) {
              s.on_wire.emplace();
              s.on_wire->on_message(message(ptp::Announce{}), Way::kUdpIpv4);
            }),
       "rp_filter"},
      {Cause::kMulticast,
       with(fresh(),
            [](PortSeen& s) {
              s.settings.unicast = true;
              s.on_wire.emplace();
              s.on_wire->on_message(message(ptp::Announce{}), Way::kUdpIpv4);
            }),
       "leave --unicast out"},
      {Cause::kSyncWithoutAnnounce,
       with(fresh(),
            [](PortSeen& s) { s.at_port.on_message(message(ptp::Sync{}), Way::kUdpIpv4); }),
       "320"},
      {Cause::kOnlyReceivers,
       with(fresh(),
            [](PortSeen& s) { s.at_port.on_message(message(ptp::DelayReq{}), Way::kUdpIpv4); }),
       "slaveOnly"}};
}

std::vector<Case> refused() {
  return {
      {Cause::kNotAcceptable,
       with(fresh(), [](PortSeen& s) { s.counters.add(Counter::kUnacceptableTransmitter); }),
       "--acceptable-transmitter"},
      {Cause::kNotAuthentic,
       with(fresh(), [](PortSeen& s) { s.counters.add(Counter::kAuthenticationMissing, 4); }),
       "or none here"},
      {Cause::kNotAuthentic,
       with(fresh(), [](PortSeen& s) { s.counters.add(Counter::kAuthenticationWrongCode, 4); }),
       "4 with a wrong code"},
      {Cause::kUnusableAnnounce,
       with(fresh(), [](PortSeen& s) { s.counters.add(Counter::kUnusableAnnounce); }),
       "--clockIdentity"},
      {Cause::kAlternate,
       with(fresh(), [](PortSeen& s) { s.counters.add(Counter::kAlternateTransmitter); }),
       "alternateMasterFlag"},
      {Cause::kUnicast, with(fresh(), [](PortSeen& s) { s.unicast_dropped = 3; }), "--unicast"},
      {Cause::kMalformed,
       with(fresh(), [](PortSeen& s) { s.counters.add(Counter::kTruncated, 9); }), "9 malformed"},
      {Cause::kNoPeer, with(fresh(), [](PortSeen& s) { s.counters.add(Counter::kNotCapable); }),
       "asCapable"},
      {Cause::kPeerDelayLimit,
       with(fresh(),
            [](PortSeen& s) {
              s.counters.add(Counter::kNotCapable);
              s.settings.highest_peer_delay = Nanoseconds{800};
              s.peer_delay = Duration::from_ns(5000.0);
            }),
       "--neighborPropDelayThresh 10000"},
      {Cause::kSeveralPeers,
       with(fresh(),
            [](PortSeen& s) {
              s.counters.add(Counter::kNotCapable);
              s.counters.add(Counter::kSeveralResponders);
            }),
       "two ports answer"},
  };
}

std::vector<Case> measured() {
  const auto count = [](Counter counter, std::uint64_t times) {
    return [counter, times](PortSeen& seen) { seen.counters.add(counter, times); };
  };
  return {
      {Cause::kAcquiring, followed(), "the path delay is not known yet"},
      {Cause::kLinkDown, with(followed(), [](PortSeen& s) { s.link = Link::kDown; }),
       "eth0 is down"},
      {Cause::kNoSync, with(followed(), [](PortSeen& s) { s.counters = {}; }), "port 319"},
      {Cause::kNoFollowUp,
       with(followed(),
            [](PortSeen& s) {
              s.counters = {};
              s.counters.add(Counter::kSyncReceived, 8);
              s.at_port.on_message(message(ptp::Sync{}, {.two_step = true}), Way::kUdpIpv4);
            }),
       "8 Syncs of two steps and no Follow_Up"},
      {Cause::kNoReceiveStamps,
       with(followed(),
            [](PortSeen& s) {
              s.counters = {};
              s.receive_stamps_missing = 8;
            }),
       "-S"},
      {Cause::kNoDelayResp, with(followed(), count(Counter::kDelayReqSent, 6)), "6 Delay_Req sent"},
      {Cause::kOtherMechanism,
       with(followed(),
            [](PortSeen& s) {
              s.counters.add(Counter::kDelayReqSent, 6);
              s.at_port.on_message(message(ptp::PdelayReq{}), Way::kUdpIpv4);
            }),
       "; -P"},
      {Cause::kDelayRespForOthers,
       with(followed(),
            [](PortSeen& s) {
              s.counters.add(Counter::kDelayReqSent, 6);
              s.counters.add(Counter::kWrongRequestingPort, 6);
            }),
       "to other ports"},
      {Cause::kNoTransmitStamps, with(followed(), count(Counter::kMissingTransmitStamp, 4)),
       "--tx_timestamp_timeout"},
      {Cause::kNoPeer, with(followed(), [](PortSeen& s) { s.settings.peer_to_peer = true; }),
       "; -E"},
      {Cause::kTwoTransmitters, with(followed(), count(Counter::kTransmitterChanges, 5)),
       "changed 5 times"},
      {Cause::kTwoTransmitters, with(followed(), count(Counter::kSequenceRestarts, 5)),
       "one identity"},
      {Cause::kTwoTransmitters, with(followed(), count(Counter::kStaleSync, 8)), "8 Syncs"},
      {Cause::kTwoTransmitters, with(followed(), count(Counter::kContradictingFollowUp, 8)),
       "one transmitter of each identity"},
      {Cause::kTimescale, with(followed(), [](PortSeen& s) { s.refusal = "it shows 1970"; }),
       "1970"},
      {Cause::kOtherSteers, with(followed(), [](PortSeen& s) { s.foreign_changes = 2; }), "chrony"},
      {Cause::kSamplesRefused, with(followed(), [](PortSeen& s) { s.samples.rejected = 9; }),
       "9 of 9"},
  };
}

std::vector<Case> too_far() {
  return {
      {Cause::kFirstOffset,
       with(followed(),
            [](PortSeen& s) {
              s.samples.refused = 5;
              s.servo.offset = Duration::from_ns(-37e9);
            }),
       "-37.000 s from the reference, and without a step no more than 1 s is removed"},
      {Cause::kFirstOffset,
       with(followed(),
            [](PortSeen& s) {
              s.locked = true;  // the virtual clock of a trial is
              s.clock = "CLOCK_REALTIME";
              s.first_offset = Duration::from_ns(5e9);
            }),
       "CLOCK_REALTIME is +5.000 s"},
  };
}

TEST(PortDiagnosis, each_cause_has_its_sentence_and_none_says_locked) {
  for (const auto& cases : {heard(), refused(), measured(), too_far()}) {
    for (const Case& one : cases) {
      const Finding found = diagnose(one.seen);
      const std::string text = sentence(found);
      EXPECT_EQ(name(found.cause), name(one.cause)) << text;
      EXPECT_NE(text.find(one.remedy), std::string::npos) << text;
      EXPECT_TRUE(text.starts_with("not locked: ")) << text;
    }
  }
}

TEST(PortDiagnosis, nobody_is_blamed_before_an_announce_may_have_come) {
  const PortSeen silent = fresh();
  PortSeen syncs = fresh();
  syncs.at_port.on_message(message(ptp::Sync{}), Way::kUdpIpv4);
  PortSeen asked = fresh();
  asked.at_port.on_message(message(ptp::DelayReq{}), Way::kUdpIpv4);
  for (PortSeen seen : {silent, syncs, asked}) {
    const Cause in_time = diagnose(seen).cause;
    seen.seconds = 0.5;
    EXPECT_EQ(sentence(diagnose(seen)),
              "not locked: no Announce yet after 0.5 s on eth0, domain 0, UDPv4, transportSpecific "
              "0; expected one every 2 s");
    seen.seconds = 5.9;
    EXPECT_EQ(diagnose(seen).expected, "one every 2 s");
    seen.seconds = 6.1;
    EXPECT_EQ(diagnose(seen).cause, in_time);
    EXPECT_NE(diagnose(seen).expected, "one every 2 s");
    seen.settings.announce_interval_s = 0.125;
    seen.seconds = 1.9;
    EXPECT_EQ(diagnose(seen).cause, Cause::kNoAnnounce);
    seen.seconds = 2.1;
    EXPECT_EQ(diagnose(seen).cause, in_time);
  }
  PortSeen elsewhere = fresh();
  elsewhere.seconds = 0.1;
  elsewhere.at_port.on_message(message(ptp::Announce{}, {.domain = 5}), Way::kUdpIpv4);
  EXPECT_EQ(diagnose(elsewhere).cause, Cause::kDomain) << "what was heard is no guess";
}

TEST(PortDiagnosis, a_locked_port_says_so_whatever_else_was_counted) {
  PortSeen seen = followed();
  seen.locked = true;
  seen.counters.add(Counter::kMissingTransmitStamp, 3);
  EXPECT_EQ(diagnose(seen).cause, Cause::kLocked);
  EXPECT_TRUE(sentence(diagnose(seen)).starts_with("locked: offset "));
}

TEST(PortDiagnosis, a_clock_that_another_program_moves_too_is_in_doubt_and_not_called_locked) {
  PortSeen seen = followed();
  seen.locked = true;
  seen.foreign_changes = 3;
  EXPECT_EQ(diagnose(seen).cause, Cause::kLocked) << "a virtual one stands apart";
  seen.clock = "/dev/ptp0";
  EXPECT_EQ(diagnose(seen).cause, Cause::kOtherSteers);
  const std::string text = sentence(diagnose(seen));
  EXPECT_TRUE(text.starts_with("in doubt: another program changed /dev/ptp0 3 times")) << text;
}

std::vector<std::uint8_t> frame(const std::vector<std::uint8_t>& message) {
  std::vector<std::uint8_t> octets{0x01, 0x80, 0xC2, 0, 0, 0x0E, 2, 2, 2, 2, 2, 2, 0x88, 0xF7};
  octets.insert(octets.end(), message.begin(), message.end());
  return octets;
}

TEST(PortDiagnosis, what_only_a_listener_to_the_whole_wire_hears_is_no_lock) {
  PortSeen seen = followed();
  seen.locked = true;
  seen.settings.way = Way::kEthernet;
  seen.settings.group = {0x01, 0x1B, 0x19, 0, 0, 0};
  seen.on_wire.emplace();
  seen.on_wire->on_frame(frame(message(ptp::Announce{})));
  EXPECT_EQ(diagnose(seen).cause, Cause::kGroup);
  EXPECT_NE(sentence(diagnose(seen)).find("--ptp_dst_mac 01:80:C2:00:00:0E"), std::string::npos);
}

TEST(PortDiagnosis, times_that_a_real_clock_would_not_follow_are_remarks_for_a_virtual_one) {
  for (const bool real : {false, true}) {
    PortSeen seen = followed();
    seen.locked = true;
    seen.steers_real_clock = real;
    const auto all = diagnose_all(seen);  // the Announce has no flag of the PTP timescale
    ASSERT_EQ(all.size(), real ? 1U : 2U);
    EXPECT_EQ(all.back().cause, Cause::kTimescale);
    EXPECT_EQ(all.front().cause, real ? Cause::kTimescale : Cause::kLocked);
  }
}

TEST(PortDiagnosis, a_second_transmitter_is_remarked_on) {
  PortSeen seen = followed();
  seen.locked = true;
  ASSERT_EQ(diagnose_all(seen).back().cause, Cause::kTimescale);
  auto other = message(ptp::Announce{});
  other[20] = 0xEE;  // of its identity
  seen.at_port.on_message(other, Way::kUdpIpv4);
  const auto all = diagnose_all(seen);
  EXPECT_EQ(all.back().cause, Cause::kTwoTransmitters);
}

TEST(PortDiagnosis, a_clock_that_follows_two_transmitters_of_one_identity_is_in_doubt) {
  PortSeen seen = followed();
  seen.locked = true;
  seen.counters.add(Counter::kStaleSync, 7);
  EXPECT_EQ(diagnose(seen).cause, Cause::kLocked) << "a transmitter that was started again";
  seen.counters.add(Counter::kStaleSync, 1);
  EXPECT_TRUE(sentence(diagnose(seen)).starts_with("in doubt: 8 Syncs"));
  seen.counters.add(Counter::kForwardPairs, 100);
  EXPECT_EQ(diagnose(seen).cause, Cause::kLocked) << "a few of many";
}

TEST(PortDiagnosis, what_steers_nothing_says_so) {
  PortSeen seen = followed();
  seen.locked = true;
  seen.settings.steers = false;
  EXPECT_TRUE(sentence(diagnose(seen)).ends_with("nothing is steered"));
}

TEST(PortDiagnosis, names_are_different_and_there_is_one_for_each_cause) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kCauses; ++i) names.insert(name(static_cast<Cause>(i)));
  EXPECT_EQ(names.size(), kCauses);
  EXPECT_FALSE(names.contains(""));
}

}  // namespace
}  // namespace ftcs::diagnosis
