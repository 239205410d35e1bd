// SPDX-License-Identifier: MIT
//
// The world: a transmitter whose clock is the reference, and whose timers run on a free-running
// clock that began at zero.
#include "ftcs/ptp/time_transmitter.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"

namespace ftcs::ptp {
namespace {
using namespace std::chrono_literals;

const PortIdentity kUs{ClockIdentity::from_mac({2, 0, 0, 0, 0, 0xA}), 1};
const PortIdentity kReceiver{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};

FreeRunningTime raw(Nanoseconds time) { return FreeRunningTime{Duration{time}}; }
ReferenceTime reference(Nanoseconds time) { return ReferenceTime{Duration{time + 1'800'000'000s}}; }

struct Sent {
  SendMessage how;
  Message message;
};

std::vector<Sent> sent(const ActionList& actions) {
  std::vector<Sent> all;
  for (const Action& action : actions) {
    if (const auto* send = std::get_if<SendMessage>(&action)) {
      const auto message = decode(send->bytes.view());
      EXPECT_TRUE(message.ok());
      EXPECT_EQ(type_of(message->body), send->type);
      EXPECT_EQ(message->header.sequence_id, send->sequence_id);
      all.push_back({*send, *message});
    }
  }
  return all;
}

class Transmitter : public testing::Test {
 protected:
  explicit Transmitter(const TimeTransmitterConfig& config = default_config())
      : transmitter_(config) {
    static_cast<void>(transmitter_.start(raw(0s)));
  }
  static TimeTransmitterConfig default_config() {
    TimeTransmitterConfig config;
    config.port = kUs;
    config.domain = 3;
    config.log_announce_interval = 0;
    config.log_sync_interval = -3;
    config.log_min_delay_req_interval = -2;
    config.priority1 = 10;
    config.priority2 = 20;
    config.quality = {6, 0x21, 0x4E5D};
    config.announce_flags = flag::kPtpTimescale | flag::kUtcOffsetValid;
    return config;
  }
  static MessageBytes delay_req(std::uint16_t flags = 0) {
    Message message;
    message.header.domain = 3;
    message.header.flags = flags;
    message.header.source = kReceiver;
    message.header.sequence_id = 77;
    message.header.correction = Duration::from_ns(12.5);
    message.body = DelayReq{};
    return *encode(message);
  }
  [[nodiscard]] std::uint64_t count(Counter counter) const {
    return transmitter_.counters()[counter];
  }
  TimeTransmitter transmitter_;
};

TEST_F(Transmitter, tells_of_another_that_announces_itself) {
  const MessageBytes other =
      *encode(Message{Header{.domain = 3, .source = {{{9}}, 1}}, Announce{}});
  const ActionList actions = transmitter_.on_general_message(other.view(), FreeRunningTime{});
  ASSERT_EQ(actions.size(), 1U);
  EXPECT_EQ(std::get<TransmitterSeen>(actions[0]).port, (PortIdentity{{{9}}, 1}));
}

TEST_F(Transmitter, a_flood_of_requests_is_answered_a_few_and_another_receiver_each_time) {
  const PortIdentity other{ClockIdentity::from_mac({2, 0, 0, 0, 0, 2}), 1};
  std::size_t answers_to_other = 0;
  std::size_t answers_to_flood = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Nanoseconds now = 1s + i * 100us;
    const PortIdentity source = i % 1000 == 0 ? other : kReceiver;
    const MessageBytes request = *encode(
        Message{Header{.domain = 3, .source = source, .sequence_id = static_cast<std::uint16_t>(i)},
                DelayReq{}});
    const auto answers =
        sent(transmitter_.on_event_message(request.view(), reference(now), raw(now)));
    (source == other ? answers_to_other : answers_to_flood) += answers.size();
  }
  EXPECT_EQ(answers_to_other, 100U);
  EXPECT_LE(answers_to_flood, 11U * 256U) << "ten seconds and a full bucket";
  EXPECT_GT(answers_to_flood, 11U * 255U);
  EXPECT_EQ(count(Counter::kAnswersRefused), 100'000U - answers_to_other - answers_to_flood);
  EXPECT_EQ(count(Counter::kDelayReqReceived), count(Counter::kDelayRespSent));
}

TEST_F(Transmitter, becomes_the_transmitter_at_once) {
  TimeTransmitter transmitter(default_config());
  EXPECT_EQ(transmitter.state(), PortState::kInitializing);
  EXPECT_FALSE(transmitter.deadline().has_value());
  EXPECT_EQ(transmitter.start(raw(1s)).size(), 2U);
  EXPECT_EQ(to_string(transmitter.state()), "MASTER");
  EXPECT_EQ(transmitter.deadline(), raw(1s));
}

TEST_F(Transmitter, announces_itself_as_the_grandmaster) {
  const auto messages = sent(transmitter_.on_timer(raw(0s)));
  ASSERT_EQ(messages.size(), 2U);
  const auto& header = messages[0].message.header;
  const auto* announce = std::get_if<Announce>(&messages[0].message.body);
  ASSERT_NE(announce, nullptr);
  EXPECT_EQ(messages[0].how.channel, Channel::kGeneral);
  EXPECT_EQ(messages[0].how.destination, Destination::kMulticast);
  EXPECT_EQ(header.domain, 3);
  EXPECT_EQ(header.source, kUs);
  EXPECT_EQ(header.log_interval, 0);
  EXPECT_EQ(header.flags, flag::kPtpTimescale | flag::kUtcOffsetValid);
  EXPECT_EQ(announce->grandmaster, kUs.clock);
  EXPECT_EQ(announce->priority1, 10);
  EXPECT_EQ(announce->priority2, 20);
  EXPECT_EQ(announce->quality, (ClockQuality{6, 0x21, 0x4E5D}));
  EXPECT_EQ(announce->utc_offset, 37);
  EXPECT_EQ(announce->steps_removed, 0);
}

TEST_F(Transmitter, keeps_its_schedule) {
  int announces = 0;
  int syncs = 0;
  for (FreeRunningTime now = raw(0s); now < raw(8s); now = *transmitter_.deadline()) {
    for (const auto& one : sent(transmitter_.on_timer(now))) {
      announces += one.how.type == MessageType::kAnnounce ? 1 : 0;
      syncs += one.how.type == MessageType::kSync ? 1 : 0;
    }
  }
  EXPECT_EQ(announces, 8);
  EXPECT_EQ(syncs, 64);
}

TEST_F(Transmitter, being_called_late_does_not_shift_its_schedule) {
  static_cast<void>(transmitter_.on_timer(raw(7ms)));
  EXPECT_EQ(transmitter_.deadline(), raw(125ms));
  static_cast<void>(transmitter_.on_timer(raw(130ms)));
  EXPECT_EQ(transmitter_.deadline(), raw(250ms));
}

TEST_F(Transmitter, sends_no_burst_after_it_has_slept) {
  static_cast<void>(transmitter_.on_timer(raw(0s)));
  EXPECT_EQ(sent(transmitter_.on_timer(raw(60s))).size(), 2U);
  EXPECT_TRUE(transmitter_.on_timer(raw(60s)).empty());
  EXPECT_GT(*transmitter_.deadline(), raw(60s));
}

TEST_F(Transmitter, follow_up_carries_the_transmit_stamp_to_the_last_fraction) {
  const auto sync = sent(transmitter_.on_timer(raw(0s)))[1];
  EXPECT_EQ(sync.how.channel, Channel::kEvent);
  EXPECT_TRUE(sync.message.header.has(flag::kTwoStep));
  EXPECT_EQ(sync.message.header.log_interval, -3);
  const auto stamp = reference(1s) + Duration::from_ns(0.75);
  const auto follow = sent(transmitter_.on_transmit_timestamp(
      {MessageType::kSync, sync.how.sequence_id}, stamp, raw(1s)));
  ASSERT_EQ(follow.size(), 1U);
  EXPECT_EQ(follow[0].how.channel, Channel::kGeneral);
  EXPECT_EQ(follow[0].message.header.sequence_id, sync.how.sequence_id);
  EXPECT_EQ(std::get<FollowUp>(follow[0].message.body).precise_origin, reference(1s));
  EXPECT_EQ(follow[0].message.header.correction, Duration::from_ns(0.75));
}

TEST_F(Transmitter, without_a_stamp_no_follow_up_is_sent) {
  const auto id = sent(transmitter_.on_timer(raw(0s)))[1].how.sequence_id;
  EXPECT_TRUE(
      transmitter_.on_transmit_timestamp_missing({MessageType::kSync, id}, raw(0s)).empty());
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U);
  EXPECT_EQ(count(Counter::kFollowUpSent), 0U);
  for (int i = 0; i < 4; ++i) static_cast<void>(transmitter_.on_timer(*transmitter_.deadline()));
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U) << "counted once";
  EXPECT_TRUE(
      transmitter_.on_transmit_timestamp({MessageType::kSync, id}, reference(0s), raw(0s)).empty());
  EXPECT_EQ(count(Counter::kUnexpectedTransmitStamp), 1U) << "four Syncs later";
}

TEST_F(Transmitter, a_stamp_that_comes_after_its_timeout_is_still_that_of_its_sync) {
  const auto id = sent(transmitter_.on_timer(raw(0s)))[1].how.sequence_id;
  static_cast<void>(transmitter_.on_transmit_timestamp_missing({MessageType::kSync, id}, raw(0s)));
  const auto follow =
      sent(transmitter_.on_transmit_timestamp({MessageType::kSync, id}, reference(0s), raw(30ms)));
  ASSERT_EQ(follow.size(), 1U);
  EXPECT_EQ(follow[0].message.header.sequence_id, id);
  EXPECT_EQ(std::get<FollowUp>(follow[0].message.body).precise_origin, reference(0s));
  EXPECT_EQ(count(Counter::kUnexpectedTransmitStamp), 0U);
}

TEST_F(Transmitter, a_stamp_that_never_comes_is_counted_when_its_place_is_needed) {
  for (int i = 0; i < 5; ++i) static_cast<void>(transmitter_.on_timer(*transmitter_.deadline()));
  EXPECT_EQ(count(Counter::kSyncSent), 5U);
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U);
}

TEST_F(Transmitter, a_stamp_before_the_epoch_is_not_sent) {
  const auto id = sent(transmitter_.on_timer(raw(0s)))[1].how.sequence_id;
  EXPECT_TRUE(
      transmitter_
          .on_transmit_timestamp({MessageType::kSync, id}, ReferenceTime::from_ns(-1), raw(0s))
          .empty());
  EXPECT_EQ(count(Counter::kUnusableTime), 1U);
  EXPECT_EQ(count(Counter::kFollowUpSent), 0U);
  EXPECT_EQ(count(Counter::kActionsDropped), 0U);
}

TEST_F(Transmitter, answers_a_delay_request_with_its_receive_stamp) {
  const auto received = reference(2s) + Duration::from_ns(0.25);
  const auto answers = sent(transmitter_.on_event_message(delay_req().view(), received, raw(2s)));
  ASSERT_EQ(answers.size(), 1U);
  const auto& header = answers[0].message.header;
  const auto& response = std::get<DelayResp>(answers[0].message.body);
  EXPECT_EQ(answers[0].how.channel, Channel::kGeneral);
  EXPECT_EQ(answers[0].how.destination, Destination::kMulticast);
  EXPECT_EQ(header.sequence_id, 77);
  EXPECT_EQ(header.log_interval, -2);
  EXPECT_EQ(response.requesting_port, kReceiver);
  EXPECT_EQ(response.receive, reference(2s));
  // Receivers take t4 - correction: request's correction away, fraction of the stamp back in.
  EXPECT_EQ(response.receive - header.correction, received - Duration::from_ns(12.5));
}

TEST_F(Transmitter, answers_by_unicast_who_asks_by_unicast) {
  const auto answers =
      sent(transmitter_.on_event_message(delay_req(flag::kUnicast).view(), reference(2s), raw(2s)));
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].how.destination, Destination::kSender);
  EXPECT_TRUE(answers[0].message.header.has(flag::kUnicast));
  EXPECT_EQ(answers[0].message.header.log_interval, kNoLogInterval);
}

class UnicastTransmitter : public Transmitter {
 protected:
  UnicastTransmitter() : Transmitter(config()) {}
  static TimeTransmitterConfig config() {
    auto config = default_config();
    config.unicast = true;
    return config;
  }
};

TEST_F(UnicastTransmitter, sends_to_its_one_peer) {
  auto messages = sent(transmitter_.on_timer(raw(0s)));
  const auto follow = sent(transmitter_.on_transmit_timestamp(
      {MessageType::kSync, messages.at(1).how.sequence_id}, reference(0s), raw(0s)));
  messages.insert(messages.end(), follow.begin(), follow.end());
  ASSERT_EQ(messages.size(), 3U);
  for (const auto& one : messages) {
    EXPECT_EQ(one.how.destination, Destination::kPeer);
    EXPECT_TRUE(one.message.header.has(flag::kUnicast));
    EXPECT_EQ(one.message.header.log_interval, kNoLogInterval);
  }
}

TEST_F(Transmitter, leaves_alone_what_is_not_for_it) {
  const auto receive = [&](const PortIdentity& source, std::uint8_t domain, const Body& body) {
    Message message;
    message.header.domain = domain;
    message.header.source = source;
    message.body = body;
    return transmitter_.on_event_message(encode(message)->view(), reference(0s), raw(0s));
  };
  EXPECT_TRUE(receive(kReceiver, 0, DelayReq{}).empty());
  EXPECT_TRUE(receive(kUs, 3, Sync{}).empty());
  EXPECT_TRUE(sent(receive(kReceiver, 3, Announce{})).empty());
  EXPECT_TRUE(receive(kReceiver, 3, PdelayReq{}).empty());
  EXPECT_TRUE(receive(kReceiver, 3, Management{}).empty());
  EXPECT_TRUE(receive(kReceiver, 3, Signaling{}).empty());
  EXPECT_TRUE(transmitter_.on_general_message(delay_req().view(), raw(0s)).empty());
  EXPECT_TRUE(transmitter_.on_general_message({}, raw(0s)).empty());
  for (const auto counter :
       {Counter::kWrongDomain, Counter::kOwnMessage, Counter::kNotForThisRole,
        Counter::kPdelayIgnored, Counter::kManagementIgnored, Counter::kSignalingIgnored,
        Counter::kWrongChannel, Counter::kTruncated}) {
    EXPECT_EQ(count(counter), 1U) << to_string(counter);
  }
  EXPECT_EQ(count(Counter::kDelayRespSent), 0U);
}

TEST_F(Transmitter, while_the_link_is_down_it_is_silent) {
  static_cast<void>(transmitter_.on_link_down(raw(1s)));
  EXPECT_EQ(transmitter_.state(), PortState::kFaulty);
  EXPECT_FALSE(transmitter_.deadline().has_value());
  EXPECT_TRUE(transmitter_.on_timer(raw(2s)).empty());
  EXPECT_TRUE(transmitter_.on_event_message(delay_req().view(), reference(2s), raw(2s)).empty());
  EXPECT_EQ(count(Counter::kNotListening), 1U);
  static_cast<void>(transmitter_.on_link_up(raw(3s)));
  EXPECT_EQ(sent(transmitter_.on_timer(raw(3s))).size(), 2U);
}

TEST_F(Transmitter, allocates_nothing) {
  const auto request = delay_req();
  std::size_t actions = 0;
  {
    const test::ForbidAllocation guard;
    actions += transmitter_.on_timer(raw(0s)).size();
    actions +=
        transmitter_.on_transmit_timestamp({MessageType::kSync, 0}, reference(0s), raw(0s)).size();
    actions += transmitter_.on_event_message(request.view(), reference(0s), raw(0s)).size();
  }
  EXPECT_EQ(actions, 4U);
}

/// IEEE 802.1AS: peer to peer, information in Follow_Up, path trace in Announce.
class GptpTransmitter : public Transmitter {
 protected:
  GptpTransmitter() : Transmitter(gptp_config()) {}
  static TimeTransmitterConfig gptp_config() {
    TimeTransmitterConfig config = default_config();
    config.domain = 0;
    config.major_sdo_id = 1;
    config.delay_mechanism = DelayMechanism::kPeerToPeer;
    config.peer_delay.capability_needed = true;
    config.follow_up_info = true;
    config.path_trace = true;
    return config;
  }
  ActionList hand_over(Message message, Nanoseconds at) {
    message.header.major_sdo_id = 1;
    message.header.source = kReceiver;
    const auto bytes = encode(message);
    return transmitter_.on_event_message(bytes->view(), reference(at), raw(at));
  }
  /// The neighbour answers the request of this second.
  std::vector<Sent> second(Nanoseconds at) {
    const auto messages = sent(transmitter_.on_timer(raw(at)));
    for (const auto& one : messages) {
      if (one.how.type != MessageType::kPdelayReq) continue;
      static_cast<void>(transmitter_.on_transmit_timestamp(one.how.id(), reference(at), raw(at)));
      Message answer;
      answer.header.flags = flag::kTwoStep;
      answer.header.sequence_id = one.how.sequence_id;
      answer.body = PdelayResp{reference(at + 500ns), kUs};
      static_cast<void>(hand_over(answer, at + 1us));
      answer.body = PdelayRespFollowUp{reference(at + 500ns), kUs};
      static_cast<void>(hand_over(answer, at + 2us));
    }
    return messages;
  }
};

TEST_F(GptpTransmitter, transmits_nothing_but_questions_until_the_neighbour_is_capable) {
  for (const Nanoseconds at : {0s, 1s}) {
    const auto messages = second(at);
    ASSERT_EQ(messages.size(), 1U);
    EXPECT_EQ(messages[0].how.type, MessageType::kPdelayReq);
  }
  EXPECT_EQ(transmitter_.peer_delay().mean_link_delay(), Duration{500ns});
  const auto messages = sent(transmitter_.on_timer(raw(2s)));
  ASSERT_EQ(messages.size(), 3U);
  EXPECT_EQ(messages[1].how.type, MessageType::kAnnounce);
  EXPECT_EQ(messages[2].how.type, MessageType::kSync);
}

TEST_F(GptpTransmitter, says_in_announce_and_follow_up_what_802_1as_wants_to_be_told) {
  for (const Nanoseconds at : {0s, 1s}) static_cast<void>(second(at));
  const auto actions = transmitter_.on_timer(raw(2s));
  const auto messages = sent(actions);
  const auto announce = messages.at(1).how.bytes.view();
  ASSERT_EQ(announce.size(), 76U);
  EXPECT_EQ(announce[65], 0x08);  // PATH_TRACE
  EXPECT_EQ(announce[67], 8);
  EXPECT_TRUE(std::equal(kUs.clock.octets.begin(), kUs.clock.octets.end(), announce.begin() + 68));
  const auto follow_ups =
      sent(transmitter_.on_transmit_timestamp(messages.at(2).how.id(), reference(2s), raw(2s)));
  ASSERT_EQ(follow_ups.size(), 1U);
  const auto octets = follow_ups[0].how.bytes.view();
  ASSERT_EQ(octets.size(), 76U);
  EXPECT_EQ((std::vector<std::uint8_t>(octets.begin() + 44, octets.begin() + 54)),
            (std::vector<std::uint8_t>{0, 3, 0, 28, 0, 0x80, 0xC2, 0, 0, 1}));
  EXPECT_TRUE(std::get<FollowUp>(follow_ups[0].message.body).has_information);
}

TEST_F(GptpTransmitter, ignores_end_to_end_requests_and_answers_its_neighbour) {
  Message message;
  message.body = DelayReq{};
  EXPECT_TRUE(hand_over(message, 1s).empty());
  EXPECT_EQ(count(Counter::kDelayIgnored), 1U);
  message.body = PdelayReq{};
  const auto answer = sent(hand_over(message, 1s));
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_EQ(answer[0].how.destination, Destination::kNeighbour);
  static_cast<void>(transmitter_.on_link_down(raw(2s)));
  EXPECT_FALSE(transmitter_.deadline().has_value());
}

}  // namespace
}  // namespace ftcs::ptp
