// SPDX-License-Identifier: MIT
//
// The world: receiver_fixture.h. The ordinary course of a receiver, and its link.
#include "ftcs/ptp/time_receiver.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/receiver_fixture.h"

namespace ftcs::ptp::receiver_test {
namespace {

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
  const auto again = general(announce_from(kA), 500ms);
  ASSERT_EQ(again.size(), 1U) << "told each time, for who believes only what lasts";
  EXPECT_FALSE(of<TransmitterSelected>(again).at(0).changed);
  EXPECT_TRUE(general(announce_from(kB), 600ms).size() == 1U) << "a new foreign master, no more";
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
  EXPECT_TRUE(receiver_.on_transmit_timestamp({MessageType::kDelayReq, first}, local(1s), local(1s))
                  .empty());
  const auto pairs = of<EmitPair>(general(response, 1s + 2 * kDelay));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.direction, Direction::kBackward);
  EXPECT_EQ(pairs[0].pair.free_running, local(1s));
  EXPECT_EQ(pairs[0].pair.reference, reference(1s + kDelay) - Duration{40ns});

  const auto due = *receiver_.deadline() + Duration{300ms};
  const auto second = of<SendMessage>(receiver_.on_timer(due))[0].sequence_id;
  EXPECT_TRUE(of<EmitPair>(general(delay_resp(second, 2s), 2s)).empty());
  EXPECT_EQ(of<EmitPair>(receiver_.on_transmit_timestamp({MessageType::kDelayReq, second},
                                                         local(2s), local(2s)))
                .size(),
            1U);
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
  EXPECT_GT(*receiver_.deadline(), local(1s));
  auto now = local(1s);
  auto requested = now;
  double sum = 0.0;
  for (int i = 0; i < 200;) {
    static_cast<void>(receiver_.on_general_message(bytes_of(announce_from(kA)).view(), now));
    now = std::min(*receiver_.deadline(), now + Duration{1s});
    if (of<SendMessage>(receiver_.on_timer(now)).empty()) continue;
    sum += (now - requested).seconds();
    requested = now;
    ++i;
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
  static_cast<void>(receiver_.on_transmit_timestamp(
      {MessageType::kDelayReq, requests[0].sequence_id}, local(3s), local(3s)));
  const auto backward =
      of<EmitPair>(general(in_domain(delay_resp(requests[0].sequence_id, 3s + 400ms)), 4s));
  ASSERT_EQ(backward.size(), 1U);
  EXPECT_EQ(backward[0].pair.reference, reference(3s + 400ms) + Duration{500ns});
}

// The link.

TEST_F(Receiver, while_the_link_is_down_nothing_is_heard_and_nothing_is_due) {
  select_a();
  static_cast<void>(event(sync_from(kA, 0), 300ms));
  static_cast<void>(receiver_.on_link_down(local(400ms)));
  EXPECT_EQ(receiver_.state(), PortState::kFaulty);
  EXPECT_EQ(count(Counter::kLinkDown), 1U);
  EXPECT_EQ(receiver_.transmitter(), nullptr);
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
}  // namespace ftcs::ptp::receiver_test
