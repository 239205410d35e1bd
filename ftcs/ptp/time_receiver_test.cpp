// SPDX-License-Identifier: MIT
//
// The world: a receiver on its free-running clock, which shows true time plus 5 s, and messages
// that a test hands to it by its own hand: well-formed unless the test breaks them. Transmitter A
// announces four times a second and sends two-step Syncs eight times a second. Each test of a
// mishap names its counter and shows the reaction.
#include "ftcs/ptp/time_receiver.h"

#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"

namespace ftcs::ptp {
namespace {
using namespace std::chrono_literals;

const PortIdentity kA{ClockIdentity::from_mac({2, 0, 0, 0, 0, 0xA}), 1};
const PortIdentity kB{ClockIdentity::from_mac({2, 0, 0, 0, 0, 0xB}), 1};
const PortIdentity kUs{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
const PortIdentity kOther{ClockIdentity::from_mac({2, 0, 0, 0, 0, 2}), 1};
constexpr Nanoseconds kEpoch = 1'800'000'000s;
constexpr Nanoseconds kDelay = 10us;

FreeRunningTime local(Nanoseconds time) { return FreeRunningTime{Duration{time + 5s}}; }
ReferenceTime reference(Nanoseconds time) { return ReferenceTime{Duration{time + kEpoch}}; }

template <class T>
std::vector<T> of(const ActionList& actions) {
  std::vector<T> found;
  for (const Action& action : actions) {
    if (const T* one = std::get_if<T>(&action)) found.push_back(*one);
  }
  return found;
}

MessageBytes bytes_of(const Message& message) {
  const auto bytes = encode(message);
  EXPECT_TRUE(bytes.ok());
  return *bytes;
}

Message message_from(const PortIdentity& source, std::uint16_t sequence_id, const Body& body) {
  Message message;
  message.header.source = source;
  message.header.sequence_id = sequence_id;
  message.header.log_interval = -3;
  message.body = body;
  return message;
}

Message announce_from(const PortIdentity& source, std::uint8_t priority1 = 128) {
  Announce announce;
  announce.grandmaster = source.clock;
  announce.priority1 = priority1;
  Message message = message_from(source, 0, announce);
  message.header.log_interval = 0;
  return message;
}

Message sync_from(const PortIdentity& source, std::uint16_t sequence_id) {
  Message message = message_from(source, sequence_id, Sync{});
  message.header.flags = flag::kTwoStep;
  return message;
}

class Receiver : public testing::Test {
 protected:
  explicit Receiver(const TimeReceiverConfig& config = default_config()) : receiver_(config) {
    static_cast<void>(receiver_.start(local(0s)));
  }
  static TimeReceiverConfig default_config() {
    TimeReceiverConfig config;
    config.port = kUs;
    config.log_min_delay_req_interval = -3;
    return config;
  }

  ActionList event(const Message& message, Nanoseconds at) {
    return receiver_.on_event_message(bytes_of(message).view(), local(at), local(at));
  }
  ActionList general(const Message& message, Nanoseconds at) {
    return receiver_.on_general_message(bytes_of(message).view(), local(at));
  }
  ActionList general(std::vector<std::uint8_t> octets, Nanoseconds at) {
    return receiver_.on_general_message(octets, local(at));
  }
  /// Sync of A that left at `sent`, and its Follow_Up.
  ActionList exchange(std::uint16_t sequence_id, Nanoseconds sent) {
    static_cast<void>(event(sync_from(kA, sequence_id), sent + kDelay));
    return general(follow_up(sequence_id, sent), sent + 2 * kDelay);
  }
  static Message follow_up(std::uint16_t sequence_id, Nanoseconds sent) {
    return message_from(kA, sequence_id, FollowUp{reference(sent)});
  }
  static Message delay_resp(std::uint16_t sequence_id, Nanoseconds received) {
    return message_from(kA, sequence_id, DelayResp{reference(received), kUs});
  }
  /// A announces twice: it is selected at `at` + 250 ms.
  void select_a(Nanoseconds at = 0s) {
    static_cast<void>(general(announce_from(kA), at));
    static_cast<void>(general(announce_from(kA), at + 250ms));
    ASSERT_NE(receiver_.transmitter(), nullptr);
    ASSERT_EQ(receiver_.transmitter()->port, kA);
  }
  [[nodiscard]] std::uint64_t count(Counter counter) const { return receiver_.counters()[counter]; }

  TimeReceiver receiver_;
};

// The ordinary course.

TEST_F(Receiver, walks_through_the_states_that_ptp4l_prints) {
  TimeReceiver receiver(default_config());
  EXPECT_EQ(receiver.state(), PortState::kInitializing);
  std::vector<std::string> log;
  const auto note = [&](const ActionList& actions) {
    for (const auto& change : of<PortStateChanged>(actions)) {
      log.push_back(std::string{to_string(change.from)} + " to " +
                    std::string{to_string(change.to)} + " on " +
                    std::string{to_string(change.event)});
    }
  };
  const auto announce = bytes_of(announce_from(kA));
  note(receiver.start(local(0s)));
  note(receiver.on_general_message(announce.view(), local(0s)));
  note(receiver.on_general_message(announce.view(), local(250ms)));
  note(receiver.on_servo_locked(local(1s)));
  note(receiver.on_servo_locked(local(1s)));
  note(receiver.on_servo_unlocked(local(2s)));
  note(receiver.on_timer(local(4s)));
  note(receiver.on_link_down(local(5s)));
  note(receiver.on_link_up(local(6s)));
  EXPECT_EQ(
      log,
      (std::vector<std::string>{
          "INITIALIZING to LISTENING on INIT_COMPLETE", "LISTENING to UNCALIBRATED on RS_SLAVE",
          "UNCALIBRATED to SLAVE on MASTER_CLOCK_SELECTED",
          "SLAVE to UNCALIBRATED on SYNCHRONIZATION_FAULT",
          "UNCALIBRATED to LISTENING on ANNOUNCE_RECEIPT_TIMEOUT_EXPIRES",
          "LISTENING to FAULTY on FAULT_DETECTED", "FAULTY to LISTENING on INIT_COMPLETE"}));
}

TEST_F(Receiver, selects_a_transmitter_with_its_second_announce) {
  const auto first = general(announce_from(kA), 0s);
  ASSERT_EQ(of<TransmitterSeen>(first).size(), 1U);
  EXPECT_EQ(of<TransmitterSeen>(first)[0].port, kA);
  EXPECT_EQ(receiver_.transmitter(), nullptr);
  const auto selected = of<TransmitterSelected>(general(announce_from(kA), 250ms));
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_EQ(selected[0].transmitter.port, kA);
  EXPECT_TRUE(selected[0].changed);
  EXPECT_TRUE(general(announce_from(kA), 500ms).empty()) << "nothing new";
}

TEST_F(Receiver, two_step_sync_gives_a_forward_pair_with_both_corrections) {
  select_a();
  Message sync = sync_from(kA, 7);
  sync.header.correction = Duration::from_ns(100.5);
  EXPECT_TRUE(of<EmitPair>(event(sync, 1s + kDelay)).empty());
  Message follow = follow_up(7, 1s);
  follow.header.correction = Duration::from_ns(0.25);
  const auto pairs = of<EmitPair>(general(follow, 1s + 2 * kDelay));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.direction, Direction::kForward);
  EXPECT_EQ(pairs[0].pair.reference, reference(1s) + Duration::from_ns(100.75));
  EXPECT_EQ(pairs[0].pair.free_running, local(1s + kDelay));
  EXPECT_EQ(receiver_.sync_interval(), Duration{125ms});
}

TEST_F(Receiver, one_step_sync_is_a_pair_by_itself) {
  select_a();
  Message sync = message_from(kA, 7, Sync{reference(1s)});
  sync.header.correction = Duration::from_ns(8.0);
  const auto pairs = of<EmitPair>(event(sync, 1s + kDelay));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.reference, reference(1s) + Duration{8ns});
  EXPECT_EQ(pairs[0].pair.free_running, local(1s + kDelay));
}

TEST_F(Receiver, asks_for_the_delay_at_once_after_the_first_sync) {
  select_a();
  const auto requests = of<SendMessage>(event(sync_from(kA, 0), 1s));
  ASSERT_EQ(requests.size(), 1U);
  EXPECT_EQ(requests[0].channel, Channel::kEvent);
  EXPECT_EQ(requests[0].destination, Destination::kMulticast);
  const auto request = decode(requests[0].bytes.view());
  ASSERT_TRUE(request.ok());
  EXPECT_EQ(type_of(request->body), MessageType::kDelayReq);
  EXPECT_EQ(request->header.source, kUs);
  EXPECT_EQ(request->header.sequence_id, requests[0].sequence_id);
  EXPECT_EQ(request->header.log_interval, 0x7F);
  EXPECT_TRUE(of<SendMessage>(event(sync_from(kA, 1), 1s)).empty())
      << "the next one comes by timer";
}

TEST_F(Receiver, stamp_and_response_give_a_backward_pair_in_either_order) {
  select_a();
  const auto first = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  Message response = delay_resp(first, 1s + kDelay);
  response.header.correction = Duration{40ns};
  EXPECT_TRUE(receiver_.on_transmit_timestamp(first, local(1s), local(1s)).empty());
  const auto pairs = of<EmitPair>(general(response, 1s + 2 * kDelay));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.direction, Direction::kBackward);
  EXPECT_EQ(pairs[0].pair.free_running, local(1s));
  EXPECT_EQ(pairs[0].pair.reference, reference(1s + kDelay) - Duration{40ns});

  const auto due = *receiver_.deadline() + Duration{300ms};
  const auto second = of<SendMessage>(receiver_.on_timer(due))[0].sequence_id;
  EXPECT_TRUE(of<EmitPair>(general(delay_resp(second, 2s), 2s)).empty());
  EXPECT_EQ(of<EmitPair>(receiver_.on_transmit_timestamp(second, local(2s), local(2s))).size(), 1U);
}

TEST_F(Receiver, delay_requests_are_spread_uniformly_over_twice_the_interval) {
  select_a();
  auto now = local(1s);
  static_cast<void>(receiver_.on_event_message(bytes_of(sync_from(kA, 0)).view(), now, now));
  constexpr int kRequests = 4000;
  double sum = 0.0;
  double longest = 0.0;
  int short_ones = 0;
  for (int i = 0; i < kRequests; ++i) {
    static_cast<void>(receiver_.on_general_message(bytes_of(announce_from(kA)).view(), now));
    const auto next = *receiver_.deadline();
    const double gap = (next - now).seconds();
    sum += gap;
    longest = std::max(longest, gap);
    short_ones += gap < 0.0625 ? 1 : 0;
    now = next;
    ASSERT_EQ(of<SendMessage>(receiver_.on_timer(now)).size(), 1U);
  }
  EXPECT_NEAR(sum / kRequests, 0.125, 0.005);  // standard deviation of the mean: 0.0011 s
  EXPECT_LE(longest, 0.25);
  EXPECT_NEAR(short_ones, kRequests / 4, 150);
}

TEST_F(Receiver, honours_the_delay_request_interval_that_the_transmitter_demands) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  Message response = delay_resp(id, 1s);
  response.header.log_interval = 3;
  static_cast<void>(general(response, 1s));
  Message announce = announce_from(kA);
  announce.header.log_interval = 7;  // no timeout in between
  auto now = local(1s);
  double sum = 0.0;
  for (int i = 0; i < 200; ++i) {
    static_cast<void>(receiver_.on_general_message(bytes_of(announce).view(), now));
    const auto next = *receiver_.deadline();
    sum += (next - now).seconds();
    now = next;
    ASSERT_EQ(of<SendMessage>(receiver_.on_timer(now)).size(), 1U);
  }
  EXPECT_NEAR(sum / 200.0, 8.0, 1.0);
}

TEST_F(Receiver, ignores_a_delay_request_interval_out_of_range) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  const auto before = receiver_.deadline();
  Message response = delay_resp(id, 1s);
  response.header.log_interval = -128;
  static_cast<void>(general(response, 1s));
  EXPECT_EQ(count(Counter::kBadInterval), 1U);
  EXPECT_EQ(receiver_.deadline(), before);
  response.header.log_interval = kNoLogInterval;  // as unicast responses carry it
  static_cast<void>(general(response, 1s));
  EXPECT_EQ(count(Counter::kBadInterval), 1U);
}

class UnicastReceiver : public Receiver {
 protected:
  UnicastReceiver() : Receiver(config()) {}
  static TimeReceiverConfig config() {
    auto config = default_config();
    config.unicast = true;
    config.delay_asymmetry = Duration{500ns};
    config.minor_version = 0;
    config.domain = 4;
    return config;
  }
};

TEST_F(UnicastReceiver, asks_its_peer_and_adds_the_asymmetry_to_both_directions) {
  const auto in_domain = [](Message message) {
    message.header.domain = 4;
    message.header.flags |= flag::kUnicast;
    message.header.log_interval = kNoLogInterval;
    return message;
  };
  static_cast<void>(general(in_domain(announce_from(kA)), 0s));
  static_cast<void>(general(in_domain(announce_from(kA)), 2s));  // default interval: 2 s
  const auto requests = of<SendMessage>(event(in_domain(sync_from(kA, 0)), 3s + kDelay));
  ASSERT_EQ(requests.size(), 1U);
  EXPECT_EQ(requests[0].destination, Destination::kPeer);
  const auto request = *decode(requests[0].bytes.view());
  EXPECT_TRUE(request.header.has(flag::kUnicast));
  EXPECT_EQ(request.header.minor_version, 0);
  EXPECT_EQ(request.header.domain, 4);
  const auto forward = of<EmitPair>(general(in_domain(follow_up(0, 3s)), 3s + kDelay));
  ASSERT_EQ(forward.size(), 1U);
  EXPECT_EQ(forward[0].pair.reference, reference(3s) + Duration{500ns});
  static_cast<void>(receiver_.on_transmit_timestamp(requests[0].sequence_id, local(3s), local(3s)));
  const auto backward =
      of<EmitPair>(general(in_domain(delay_resp(requests[0].sequence_id, 4s)), 4s));
  ASSERT_EQ(backward.size(), 1U);
  EXPECT_EQ(backward[0].pair.reference, reference(4s) + Duration{500ns});
}

// Order and loss.

TEST_F(Receiver, follow_up_before_sync_is_kept) {
  select_a();
  EXPECT_TRUE(of<EmitPair>(general(follow_up(3, 1s), 1s)).empty());
  EXPECT_EQ(of<EmitPair>(event(sync_from(kA, 3), 1s + kDelay)).size(), 1U);
}

TEST_F(Receiver, lost_follow_up_is_counted_and_harms_nothing) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  EXPECT_EQ(of<EmitPair>(exchange(2, 1125ms)).size(), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(3, 2500ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kLostFollowUp), 1U);
  EXPECT_TRUE(of<EmitPair>(general(follow_up(1, 1s), 2600ms)).empty()) << "too late";
  EXPECT_EQ(count(Counter::kStaleFollowUp), 1U);
}

TEST_F(Receiver, lost_sync_is_counted_and_its_follow_up_forgotten) {
  select_a();
  static_cast<void>(exchange(1, 1s));
  static_cast<void>(general(follow_up(2, 1125ms), 1125ms));
  EXPECT_EQ(of<EmitPair>(exchange(3, 1250ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kMissedSync), 1U);
  static_cast<void>(exchange(4, 2500ms));
  EXPECT_EQ(count(Counter::kLostSync), 1U);
}

TEST_F(Receiver, duplicates_are_dropped) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  static_cast<void>(event(sync_from(kA, 1), 1s + 50us));
  EXPECT_EQ(count(Counter::kDuplicateSync), 1U);
  const auto pairs = of<EmitPair>(general(follow_up(1, 1s), 1s + 60us));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.free_running, local(1s)) << "the first copy counts";
  EXPECT_TRUE(general(follow_up(1, 1s), 1s + 70us).empty());
  EXPECT_EQ(count(Counter::kDuplicateFollowUp), 1U);
  EXPECT_TRUE(of<EmitPair>(event(sync_from(kA, 1), 1s + 80us)).empty());
  EXPECT_EQ(count(Counter::kDuplicateSync), 2U);
}

TEST_F(Receiver, syncs_older_than_the_newest_are_dropped) {
  select_a();
  static_cast<void>(exchange(5, 1s));
  static_cast<void>(event(sync_from(kA, 4), 1s + 1ms));
  EXPECT_TRUE(of<EmitPair>(general(follow_up(4, 875ms), 1s + 1ms)).empty());
  EXPECT_EQ(count(Counter::kStaleSync), 1U);
  EXPECT_EQ(count(Counter::kStaleFollowUp), 1U);
}

TEST_F(Receiver, pairs_never_go_back_in_sequence) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  static_cast<void>(event(sync_from(kA, 2), 1125ms));
  EXPECT_EQ(of<EmitPair>(general(follow_up(2, 1125ms), 1200ms)).size(), 1U);
  EXPECT_TRUE(of<EmitPair>(general(follow_up(1, 1s), 1201ms)).empty());
  EXPECT_EQ(count(Counter::kStaleFollowUp), 1U);
}

TEST_F(Receiver, sequence_ids_wrap) {
  select_a();
  EXPECT_EQ(of<EmitPair>(exchange(65535, 1s)).size(), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(0, 1125ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kMissedSync), 0U);
  EXPECT_EQ(count(Counter::kSequenceRestarts), 0U);
}

TEST_F(Receiver, a_transmitter_that_restarts_is_followed_again_at_once) {
  select_a();
  static_cast<void>(exchange(5000, 1s));
  static_cast<void>(event(sync_from(kA, 5001), 1125ms));
  EXPECT_EQ(of<EmitPair>(exchange(0, 1250ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kSequenceRestarts), 1U);
  EXPECT_EQ(count(Counter::kLostFollowUp), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(1, 3s)).size(), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(0, 5s)).size(), 1U)
      << "after a pause even a near id is a restart";
}

TEST_F(Receiver, a_request_without_answer_is_counted_and_asked_again) {
  select_a();
  static_cast<void>(event(sync_from(kA, 0), 1s));
  auto now = local(1s);
  for (int i = 0; i < 4; ++i) {
    static_cast<void>(receiver_.on_general_message(bytes_of(announce_from(kA)).view(), now));
    now = *receiver_.deadline();
    static_cast<void>(receiver_.on_timer(now));
  }
  EXPECT_EQ(count(Counter::kLostDelayResp), 1U);
  EXPECT_EQ(count(Counter::kDelayReqSent), 5U);
}

TEST_F(Receiver, late_and_duplicate_delay_responses_are_dropped) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  static_cast<void>(receiver_.on_transmit_timestamp(id, local(1s), local(1s)));
  EXPECT_EQ(of<EmitPair>(general(delay_resp(id, 1s), 1s)).size(), 1U);
  EXPECT_TRUE(general(delay_resp(id, 1s), 1s).empty());
  const auto never_sent = static_cast<std::uint16_t>(id + 1);
  EXPECT_TRUE(general(delay_resp(never_sent, 1s), 1s).empty());
  EXPECT_EQ(count(Counter::kStaleDelayResp), 2U);
}

TEST_F(Receiver, a_missing_transmit_stamp_leaves_the_exchange_out) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  EXPECT_TRUE(receiver_.on_transmit_timestamp_missing(id, local(1s)).empty());
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U);
  EXPECT_TRUE(general(delay_resp(id, 1s), 1s).empty());
  EXPECT_TRUE(receiver_.on_transmit_timestamp(id, local(1s), local(1s)).empty());
  EXPECT_EQ(count(Counter::kUnexpectedTransmitStamp), 1U);
  EXPECT_TRUE(receiver_.deadline().has_value()) << "the next request comes as planned";
}

// Messages that are not for us.

TEST_F(Receiver, foreign_domains_and_profiles_are_ignored) {
  select_a();
  Message sync = sync_from(kA, 1);
  sync.header.domain = 1;
  EXPECT_TRUE(event(sync, 1s).empty());
  EXPECT_EQ(count(Counter::kWrongDomain), 1U);
  sync.header.domain = 0;
  sync.header.major_sdo_id = 1;  // IEEE 802.1AS
  EXPECT_TRUE(event(sync, 1s).empty());
  EXPECT_EQ(count(Counter::kWrongSdo), 1U);
  EXPECT_EQ(count(Counter::kSyncReceived), 0U);
}

TEST_F(Receiver, only_the_selected_transmitter_is_heard) {
  select_a();
  EXPECT_TRUE(event(sync_from(kB, 1), 1s).empty());
  EXPECT_TRUE(general(message_from(kB, 1, FollowUp{reference(1s)}), 1s).empty());
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  EXPECT_TRUE(general(message_from(kB, id, DelayResp{reference(1s), kUs}), 1s).empty());
  EXPECT_EQ(count(Counter::kWrongTransmitter), 3U);
}

TEST_F(Receiver, responses_to_other_receivers_are_ignored) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  static_cast<void>(receiver_.on_transmit_timestamp(id, local(1s), local(1s)));
  EXPECT_TRUE(general(message_from(kA, id, DelayResp{reference(1s), kOther}), 1s).empty());
  EXPECT_EQ(count(Counter::kWrongRequestingPort), 1U);
  EXPECT_EQ(of<EmitPair>(general(delay_resp(id, 1s), 1s)).size(), 1U) << "ours is still open";
}

TEST_F(Receiver, syncs_before_a_transmitter_is_selected_are_ignored) {
  EXPECT_TRUE(event(sync_from(kA, 1), 1s).empty());
  EXPECT_EQ(count(Counter::kNotListening), 1U);
}

TEST_F(Receiver, other_roles_messages_are_recognised_and_left_alone) {
  select_a();
  EXPECT_TRUE(event(message_from(kOther, 1, DelayReq{}), 1s).empty());
  EXPECT_TRUE(event(message_from(kUs, 1, DelayReq{}), 1s).empty());
  EXPECT_TRUE(event(message_from(kA, 1, PdelayReq{}), 1s).empty());
  EXPECT_TRUE(event(message_from(kA, 1, PdelayResp{}), 1s).empty());
  EXPECT_TRUE(general(message_from(kA, 1, PdelayRespFollowUp{}), 1s).empty());
  EXPECT_TRUE(general(message_from(kA, 1, Signaling{}), 1s).empty());
  EXPECT_TRUE(general(message_from(kA, 1, Management{}), 1s).empty());
  EXPECT_TRUE(general(sync_from(kA, 1), 1s).empty()) << "no receive stamp on the general port";
  Message alternate = announce_from(kB);
  alternate.header.flags = flag::kAlternateTransmitter;
  EXPECT_TRUE(general(alternate, 1s).empty());
  EXPECT_EQ(count(Counter::kNotForThisRole), 1U);
  EXPECT_EQ(count(Counter::kOwnMessage), 1U);
  EXPECT_EQ(count(Counter::kPdelayIgnored), 3U);
  EXPECT_EQ(count(Counter::kSignalingIgnored), 1U);
  EXPECT_EQ(count(Counter::kManagementIgnored), 1U);
  EXPECT_EQ(count(Counter::kWrongChannel), 1U);
  EXPECT_EQ(count(Counter::kAlternateTransmitter), 1U);
}

// Messages that are broken.

TEST_F(Receiver, each_kind_of_broken_message_has_its_counter_and_no_effect) {
  select_a();
  const auto bytes = bytes_of(follow_up(1, 1s));
  const std::vector<std::uint8_t> good(bytes.view().begin(), bytes.view().end());
  const auto broken = [&](std::size_t offset, std::uint8_t value) {
    auto octets = good;
    octets[offset] = value;
    return octets;
  };
  auto oversized = good;
  oversized.resize(kMaximumMessageSize + 1);
  auto with_tlv = good;
  with_tlv.insert(with_tlv.end(), {0, 8, 0, 9, 1, 2});
  with_tlv[3] = static_cast<std::uint8_t>(with_tlv.size());
  const struct {
    std::vector<std::uint8_t> octets;
    Counter counter;
  } kCases[] = {{{}, Counter::kTruncated},
                {{good.begin(), good.begin() + 43}, Counter::kTruncated},
                {oversized, Counter::kOversized},
                {broken(1, 0x11), Counter::kWrongVersion},
                {broken(0, 0x07), Counter::kUnknownType},
                {broken(3, 43), Counter::kWrongLength},
                {broken(34, 0xFF), Counter::kBadTimestamp},
                {broken(40, 0xFF), Counter::kBadTimestamp},
                {with_tlv, Counter::kMalformedTlv}};
  static_cast<void>(event(sync_from(kA, 1), 1s));
  for (const auto& one : kCases) {
    const auto before = count(one.counter);
    EXPECT_TRUE(general(one.octets, 1s).empty());
    EXPECT_EQ(count(one.counter), before + 1) << to_string(one.counter);
  }
  EXPECT_EQ(of<EmitPair>(general(good, 1s)).size(), 1U) << "the good one is still awaited";
}

// Values.

TEST_F(Receiver, small_negative_corrections_are_used_and_counted) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  Message follow = follow_up(1, 1s);
  follow.header.correction = Duration{-20ns};
  const auto pairs = of<EmitPair>(general(follow, 1s));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.reference, reference(1s) - Duration{20ns});
  EXPECT_EQ(count(Counter::kNegativeCorrection), 1U);
}

TEST_F(Receiver, corrections_of_more_than_a_second_are_refused) {
  select_a();
  for (const Duration absurd :
       {Duration{1s + 1ns}, Duration{-1s - 1ns}, Duration{39h}, Duration{-39h}}) {
    const auto before = count(Counter::kAbsurdCorrection);
    Message sync = sync_from(kA, 1);
    sync.header.correction = absurd;
    EXPECT_TRUE(event(sync, 1s).empty());
    Message follow = follow_up(1, 1s);
    follow.header.correction = absurd;
    EXPECT_TRUE(general(follow, 1s).empty());
    Message response = delay_resp(0, 1s);
    response.header.correction = absurd;
    EXPECT_TRUE(general(response, 1s).empty());
    EXPECT_EQ(count(Counter::kAbsurdCorrection), before + 3);
  }
  Message sync = message_from(kA, 1, Sync{reference(1s)});
  sync.header.correction = Duration{1s};
  EXPECT_EQ(of<EmitPair>(event(sync, 1s)).size(), 1U) << "the limit itself is allowed";
}

TEST_F(Receiver, a_jump_of_the_reference_is_reported_and_open_requests_are_forgotten) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  static_cast<void>(general(follow_up(0, 1s), 1s));
  static_cast<void>(receiver_.on_transmit_timestamp(id, local(1s), local(1s)));
  static_cast<void>(event(sync_from(kA, 1), 1125ms));
  const auto actions = general(follow_up(1, 2125ms), 1125ms);
  ASSERT_EQ(of<ReferenceJumped>(actions).size(), 1U);
  EXPECT_EQ(of<ReferenceJumped>(actions)[0].jump, Duration{1s});
  ASSERT_EQ(of<EmitPair>(actions).size(), 1U) << "the pair tells the truth: the servo decides";
  EXPECT_TRUE(std::holds_alternative<ReferenceJumped>(actions[0])) << "the news comes first";
  EXPECT_EQ(count(Counter::kReferenceJumps), 1U);
  EXPECT_TRUE(of<EmitPair>(general(delay_resp(id, 2126ms), 1126ms)).empty());
  EXPECT_EQ(count(Counter::kStaleDelayResp), 1U);
  EXPECT_EQ(of<SendMessage>(receiver_.on_timer(local(1126ms))).size(), 1U) << "asked again at once";

  static_cast<void>(event(sync_from(kA, 2), 1250ms));
  EXPECT_TRUE(of<ReferenceJumped>(general(follow_up(2, 2250ms), 1250ms)).empty()) << "told once";
  static_cast<void>(event(sync_from(kA, 3), 1375ms));
  const auto back = of<ReferenceJumped>(general(follow_up(3, 1375ms), 1375ms));
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].jump, Duration{-1s});
}

// Transmitters.

TEST_F(Receiver, a_transmitter_that_stops_is_given_up_after_three_of_its_intervals) {
  select_a();
  static_cast<void>(event(sync_from(kA, 0), 300ms));
  static_cast<void>(receiver_.on_timer(local(3249ms)));
  EXPECT_NE(receiver_.transmitter(), nullptr);
  const auto actions = receiver_.on_timer(local(3250ms));  // last Announce at 250 ms
  ASSERT_EQ(of<PortStateChanged>(actions).size(), 1U);
  EXPECT_EQ(of<PortStateChanged>(actions)[0].event, PortEvent::kAnnounceReceiptTimeoutExpires);
  EXPECT_EQ(receiver_.transmitter(), nullptr);
  EXPECT_FALSE(receiver_.deadline().has_value()) << "no request to nobody";
  EXPECT_EQ(count(Counter::kAnnounceTimeouts), 1U);
}

TEST_F(Receiver, a_transmitter_that_returns_is_no_new_reference) {
  select_a();
  static_cast<void>(receiver_.on_timer(local(4s)));
  static_cast<void>(general(announce_from(kA), 10s));
  const auto selected = of<TransmitterSelected>(general(announce_from(kA), 10250ms));
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_FALSE(selected[0].changed);
}

TEST_F(Receiver, a_better_transmitter_takes_over_and_open_exchanges_do_not_mix) {
  select_a();
  static_cast<void>(receiver_.on_servo_locked(local(300ms)));
  static_cast<void>(event(sync_from(kA, 1), 300ms));
  static_cast<void>(general(announce_from(kB, 1), 400ms));
  const auto actions = general(announce_from(kB, 1), 650ms);
  const auto selected = of<TransmitterSelected>(actions);
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_EQ(selected[0].transmitter.port, kB);
  EXPECT_TRUE(selected[0].changed);
  ASSERT_EQ(of<PortStateChanged>(actions).size(), 1U);
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
  EXPECT_EQ(count(Counter::kTransmitterChanges), 2U);
  EXPECT_TRUE(general(message_from(kB, 1, FollowUp{reference(300ms)}), 660ms).empty())
      << "B's Follow_Up must not meet A's Sync of the same id";
  EXPECT_TRUE(of<EmitPair>(general(follow_up(1, 300ms), 660ms)).empty());
}

TEST_F(Receiver, a_transmitter_that_changes_its_identity_is_followed_under_the_new_one) {
  select_a();
  for (Nanoseconds at = 500ms; at <= 2500ms; at += 1s) {
    static_cast<void>(general(announce_from(kB), at));
  }
  EXPECT_EQ(receiver_.transmitter()->port, kA) << "A is better by identity and not yet silent";
  const auto actions = receiver_.on_timer(local(3250ms));
  ASSERT_EQ(of<TransmitterSelected>(actions).size(), 1U);
  EXPECT_TRUE(of<TransmitterSelected>(actions)[0].changed);
  EXPECT_EQ(receiver_.transmitter()->port, kB);
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
}

TEST_F(Receiver, a_new_grandmaster_behind_the_same_port_is_another_reference) {
  select_a();
  Message announce = announce_from(kA);
  std::get<Announce>(announce.body).utc_offset = 38;
  auto selected = of<TransmitterSelected>(general(announce, 500ms));
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_FALSE(selected[0].changed) << "only what it says has changed";
  std::get<Announce>(announce.body).grandmaster = kB.clock;
  selected = of<TransmitterSelected>(general(announce, 750ms));
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_TRUE(selected[0].changed);
}

TEST_F(Receiver, announces_that_went_too_far_or_claim_our_identity_are_refused) {
  Message announce = announce_from(kA);
  std::get<Announce>(announce.body).steps_removed = 255;
  EXPECT_TRUE(general(announce, 0s).empty());
  std::get<Announce>(announce.body) = Announce{};
  std::get<Announce>(announce.body).grandmaster = kUs.clock;
  EXPECT_TRUE(general(announce, 0s).empty());
  EXPECT_TRUE(general(announce_from({kUs.clock, 2}), 0s).empty());
  EXPECT_EQ(count(Counter::kUnusableAnnounce), 3U);
}

TEST_F(Receiver, a_flood_of_identities_does_not_push_the_selected_one_out) {
  select_a();
  for (std::uint16_t port = 2; port < 1000; ++port) {
    static_cast<void>(general(announce_from({kB.clock, port}), 300ms));
  }
  EXPECT_EQ(receiver_.transmitter()->port, kA);
  EXPECT_EQ(count(Counter::kForeignTableFull), 998U - 7U);
}

TEST_F(Receiver, an_announce_interval_out_of_range_counts_as_the_configured_one) {
  Message announce = announce_from(kA);
  announce.header.log_interval = 100;
  static_cast<void>(general(announce, 0s));
  static_cast<void>(general(announce, 1s));
  EXPECT_EQ(count(Counter::kBadInterval), 2U);
  EXPECT_EQ(receiver_.deadline(), local(1s + 3 * 2s));
}

// The link.

TEST_F(Receiver, while_the_link_is_down_nothing_is_heard_and_nothing_is_due) {
  select_a();
  static_cast<void>(event(sync_from(kA, 0), 300ms));
  static_cast<void>(receiver_.on_link_down(local(400ms)));
  EXPECT_EQ(receiver_.state(), PortState::kFaulty);
  EXPECT_EQ(count(Counter::kLinkDown), 1U);
  EXPECT_FALSE(receiver_.deadline().has_value());
  EXPECT_TRUE(general(announce_from(kA), 500ms).empty());
  EXPECT_TRUE(receiver_.on_timer(local(5s)).empty());
  EXPECT_TRUE(receiver_.on_link_down(local(6s)).empty());
  static_cast<void>(receiver_.on_link_up(local(7s)));
  EXPECT_EQ(receiver_.state(), PortState::kListening);
  select_a(8s);
  EXPECT_EQ(of<EmitPair>(exchange(1, 9s)).size(), 1U);
}

TEST_F(Receiver, allocates_nothing) {
  const auto announce = bytes_of(announce_from(kA));
  const auto sync = bytes_of(sync_from(kA, 0));
  const auto follow = bytes_of(follow_up(0, 1s));
  std::size_t actions = 0;
  {
    const test::ForbidAllocation guard;
    actions += receiver_.on_general_message(announce.view(), local(0s)).size();
    actions += receiver_.on_general_message(announce.view(), local(250ms)).size();
    actions += receiver_.on_event_message(sync.view(), local(1s), local(1s)).size();
    actions += receiver_.on_general_message(follow.view(), local(1s)).size();
    actions += receiver_.on_timer(local(10s)).size();
  }
  EXPECT_EQ(actions, 1U + 2U + 1U + 1U + 1U);
}

}  // namespace
}  // namespace ftcs::ptp
