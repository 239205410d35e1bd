// SPDX-License-Identifier: MIT
//
// World: octets of a transmitter that the test writes with its own hand; the receiver's oscillator
// shows true time plus 5 s; its clock starts 1 us ahead.
#include "ftcs/node/receiver_node.h"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/manual_source.h"
#include "test/support/receiver_fixture.h"
#include "test/support/watched_clock.h"

namespace ftcs::node {
namespace {
using namespace std::chrono_literals;
using ptp::PortState;
using ptp::receiver_test::announce_from;
using ptp::receiver_test::bytes_of;
using ptp::receiver_test::kA;
using ptp::receiver_test::kB;
using ptp::receiver_test::kDelay;
using ptp::receiver_test::kEpoch;
using ptp::receiver_test::kUs;
using ptp::receiver_test::local;
using ptp::receiver_test::message_from;
using ptp::receiver_test::reference;
using ptp::receiver_test::sync_from;

constexpr Nanoseconds kInterval = 125ms;

class Node : public testing::Test {
 protected:
  Node() {
    config.port.port = kUs;
    config.port.log_min_delay_req_interval = -3;
    config.follower.discipline.servo.kind = ServoKind::kFtcs;
  }
  void begin(Nanoseconds ahead = 1us) {
    source.instant = local(0s);
    clock.emplace(source, Duration{kEpoch - 5s + ahead});
    node.emplace(config, *clock);
    node->start(local(0s));
    take();
  }

  void take() {
    while (const auto event = node->next()) {
      events.push_back(*event);
      if (between) between(*event);
      const auto* action = std::get_if<ptp::Action>(&*event);
      const auto* sent = action != nullptr ? std::get_if<ptp::SendMessage>(action) : nullptr;
      if (sent != nullptr) requests.push_back(sent->id());
    }
  }
  void at(Nanoseconds time) {
    now = time;
    source.instant = local(time);
  }
  void general(const ptp::Message& message, Nanoseconds time) {
    at(time);
    node->on_general_message(bytes_of(message).view(), local(time));
    take();
  }
  void announce(const ptp::PortIdentity& who, Nanoseconds time, std::uint8_t priority1 = 128) {
    general(announce_from(who, priority1), time);
  }
  void sync(const ptp::PortIdentity& who, Nanoseconds sent) {
    at(sent + kDelay);
    node->on_event_message(bytes_of(sync_from(who, sequence)).view(), local(now), local(now));
    take();
    general(message_from(who, sequence++, ptp::FollowUp{reference(sent + reference_ahead)}),
            sent + 2 * kDelay);
  }
  /// What timers are due, and an answer to what they asked.
  void timers(Nanoseconds until) {
    while (node->deadline() && *node->deadline() <= local(until)) {
      at(std::max(now, Nanoseconds{(*node->deadline() - local(0s)).floor_ns() + 1}));
      node->on_timer(source.instant);
      take();
      for (const ptp::EventId& id : std::exchange(requests, {})) answer(id);
    }
  }
  void answer(const ptp::EventId& id) {
    const Nanoseconds sent = now;
    node->on_transmit_timestamp(id, local(sent), local(sent + 1us));
    take();
    general(message_from(kA, id.sequence_id,
                         ptp::DelayResp{reference(sent + reference_ahead + kDelay), kUs}),
            sent + 3 * kDelay);
  }
  void cycles(int count) {
    for (int i = 0; i < count; ++i) {
      const Nanoseconds next = start + kInterval;
      timers(next);
      start = next;
      sync(kA, start);
      if (++beats % 8 == 0) announce(kA, start + 1ms);
      node->on_silence(local(now));
      take();
    }
  }
  void lock() {
    begin();
    announce(kA, 0s);
    announce(kA, 250ms);
    start = 250ms;
    cycles(80);
  }
  template <class T>
  [[nodiscard]] std::vector<std::size_t> places() const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < events.size(); ++i) {
      const auto* action = std::get_if<ptp::Action>(&events[i]);
      if constexpr (std::is_same_v<T, Steered> || std::is_same_v<T, Note>) {
        if (std::holds_alternative<T>(events[i])) result.push_back(i);
      } else if (action != nullptr && std::holds_alternative<T>(*action)) {
        result.push_back(i);
      }
    }
    return result;
  }
  [[nodiscard]] double error_ns() {
    return (clock->local_at(source.instant).since_epoch() -
            reference(now + reference_ahead).since_epoch())
        .ns();
  }

  ReceiverNodeConfig config;
  test::ManualSource source;
  std::optional<test::WatchedClock> clock;
  std::optional<ReceiverNode> node;
  std::vector<ReceiverEvent> events;
  std::function<void(const ReceiverEvent&)> between;
  std::vector<ptp::EventId> requests;
  std::uint16_t sequence = 0;
  Nanoseconds now{};
  Nanoseconds start{};
  Nanoseconds reference_ahead{};
  int beats = 0;
};

TEST_F(Node, octets_and_stamps_lock_the_clock_and_the_port_hears_of_it) {
  lock();
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
  EXPECT_TRUE(node->locked());
  EXPECT_EQ(node->port().state(), PortState::kTimeReceiver);
  EXPECT_TRUE(places<ptp::EmitPair>().empty()) << "pairs stay inside";
}

TEST_F(Node, the_sample_that_locks_is_told_before_the_state_that_it_leads_to) {
  lock();
  const auto changes = places<ptp::PortStateChanged>();
  const auto& last = std::get<ptp::PortStateChanged>(std::get<ptp::Action>(events[changes.back()]));
  ASSERT_EQ(last.to, PortState::kTimeReceiver);
  ASSERT_TRUE(std::holds_alternative<Steered>(events[changes.back() - 1]));
  EXPECT_TRUE(std::get<Steered>(events[changes.back() - 1]).telemetry.locked);
}

TEST_F(Node, silence_takes_the_port_out_of_its_state) {
  lock();
  at(now + 1s);
  node->on_silence(local(now));
  take();
  EXPECT_EQ(node->port().state(), PortState::kUncalibrated);
  ASSERT_TRUE(std::holds_alternative<ptp::Action>(events.back()));
  ASSERT_FALSE(places<Note>().empty());
  EXPECT_EQ(std::get<Note>(events[places<Note>().back()]).kind, NoteKind::kHoldover);
}

TEST_F(Node, another_transmitter_is_another_reference_the_first_one_is_not) {
  lock();
  EXPECT_EQ(node->discipline().counters().new_references, 0U);
  announce(kB, now + 1ms, 1);
  announce(kB, now + 250ms, 1);
  EXPECT_EQ(node->discipline().counters().new_references, 1U);
  EXPECT_FALSE(node->locked());
}

// With fast start the first Announce selects, and the Syncs that came before it follow at once: in
// between the clock may be put onto the transmitter's timescale.
TEST_F(Node, a_timescale_told_with_the_transmitter_is_in_force_before_its_first_pair) {
  config.port.fast_start = true;
  config.follower.discipline.largest_offset = 1s;
  begin(37s);
  for (int i = 0; i < 3; ++i) sync(kA, i * kInterval);
  between = [this](const ReceiverEvent& event) {
    const auto* action = std::get_if<ptp::Action>(&event);
    if (action == nullptr) return;
    const auto* selected = std::get_if<ptp::TransmitterSelected>(action);
    if (selected == nullptr || !selected->changed) return;
    ServoCommand step;
    step.step = Duration{-37s};
    EXPECT_TRUE(clock->apply(step).ok());
    node->on_new_timescale();
  };
  announce(kA, 3 * kInterval);
  start = 3 * kInterval;
  cycles(40);
  EXPECT_TRUE(node->locked());
  EXPECT_EQ(node->discipline().counters().refused, 0U);
  EXPECT_FALSE(places<Steered>().empty());
}

/// Admits what came before an instant.
class GateThatCloses final : public ReferenceGate {
 public:
  bool admits(ReferenceTime, FreeRunningTime event) noexcept override { return event < until; }
  FreeRunningTime until{};
};

TEST_F(Node, what_the_gate_does_not_admit_steers_nothing) {
  GateThatCloses gate;
  gate.until = local(5s);
  begin();
  node.emplace(config, *clock, &gate);
  node->start(local(0s));
  announce(kA, 0s);
  announce(kA, 250ms);
  start = 250ms;
  cycles(30);
  const std::uint64_t used = node->discipline().counters().used;
  EXPECT_GT(used, 20U);
  cycles(60);
  EXPECT_NEAR(static_cast<double>(node->discipline().counters().used), 38.0, 1.0);
}

TEST_F(Node, a_jump_of_the_reference_is_told_and_begins_anew) {
  lock();
  events.clear();
  for (int i = 0; i < 9; ++i) {  // a second
    EXPECT_TRUE(places<ptp::ReferenceJumped>().empty());
    start += kInterval;
    at(start + kDelay);
    node->on_event_message(bytes_of(sync_from(kA, sequence)).view(), local(now), local(now));
    take();
    general(message_from(kA, sequence++, ptp::FollowUp{reference(start + 10s)}),
            start + 2 * kDelay);
  }
  EXPECT_EQ(places<ptp::ReferenceJumped>().size(), 1U);
  EXPECT_EQ(node->discipline().counters().new_references, 1U);
}

class SilentNode : public Node, public testing::WithParamInterface<Nanoseconds> {
 protected:
  /// Locked, then nothing is heard for so long, then a reference that was set meanwhile.
  void return_after_silence(StepMode mode) {
    config.port.fast_start = true;
    config.follower.discipline.largest_offset = 1s;
    config.follower.discipline.step.mode = mode;
    lock();
    const Nanoseconds back = now + GetParam();
    timers(back);
    node->on_silence(local(back));
    take();
    events.clear();
    reference_ahead = 5s;
    start = back;
    announce(kA, start);
    cycles(80);
  }
  [[nodiscard]] std::vector<Note> notes(NoteKind kind) const {
    std::vector<Note> found;
    for (const ReceiverEvent& event : events) {
      const auto* note = std::get_if<Note>(&event);
      if (note != nullptr && note->kind == kind) found.push_back(*note);
    }
    return found;
  }
};

// It was refused for ever.
TEST_P(SilentNode,
       a_reference_that_was_set_while_it_was_silent_is_stepped_to_where_that_is_permitted) {
  return_after_silence(StepMode::kFirst);
  EXPECT_TRUE(node->locked());
  EXPECT_NEAR(error_ns(), 0.0, 1'000.0);
  EXPECT_EQ(node->discipline().counters().steps, 1U);
  for (const ReceiverEvent& event : events) {
    if (const auto* action = std::get_if<ptp::Action>(&event);
        action != nullptr && std::holds_alternative<ptp::ReferenceJumped>(*action)) {
      return;
    }
  }
  const auto jumped = notes(NoteKind::kReferenceJumped);
  ASSERT_EQ(jumped.size(), 1U);
  EXPECT_EQ(jumped[0].plan.response, JumpResponse::kStepped);
  EXPECT_NEAR(jumped[0].jump.seconds(), 5.0, 1e-3);
}

TEST_P(SilentNode, a_reference_that_was_set_while_it_was_silent_is_refused_aloud_where_it_is_not) {
  return_after_silence(StepMode::kNever);
  EXPECT_FALSE(node->locked());
  EXPECT_EQ(node->discipline().counters().steps, 0U);
  EXPECT_NEAR(error_ns(), -5e9, 1e6);
  EXPECT_GE(notes(NoteKind::kOffsetRefused).size(), 3U);
}

// Shorter than a ninth of the silence is no jump against the oscillator.
INSTANTIATE_TEST_SUITE_P(Silence, SilentNode, testing::Values(8s, 60s, 3600s));

/// Admits no change of more than a second.
class GateOfChanges final : public ReferenceGate {
 public:
  bool admits(ReferenceTime, FreeRunningTime) noexcept override { return true; }
  bool admits_change(Duration change) const noexcept override {
    return abs(change) <= Duration{1s};
  }
};

// It was "stepped there", and then not followed.
TEST_F(Node, a_jump_that_the_gate_does_not_admit_is_not_said_to_be_followed) {
  GateOfChanges gate;
  config.follower.discipline.largest_offset = 1s;
  config.follower.discipline.step.mode = StepMode::kFirst;
  begin();
  node.emplace(config, *clock, &gate);
  node->start(local(0s));
  announce(kA, 0s);
  announce(kA, 250ms);
  start = 250ms;
  cycles(80);
  events.clear();
  reference_ahead = 2s;
  cycles(12);
  const auto told = places<Note>();
  const auto jumped = std::find_if(told.begin(), told.end(), [this](std::size_t place) {
    return std::get<Note>(events[place]).kind == NoteKind::kReferenceJumped;
  });
  ASSERT_NE(jumped, told.end());
  const Note& note = std::get<Note>(events[*jumped]);
  EXPECT_TRUE(note.gated);
  EXPECT_EQ(note.plan.response, JumpResponse::kRefused);
}

// Eight forged frames ended the program; a better word of oneself was worth any time.
TEST_F(Node, a_better_transmitter_that_is_seconds_off_is_doubted_and_the_other_followed_again) {
  config.follower.discipline.largest_offset = 1s;
  lock();
  announce(kB, now + 1ms, 1);
  announce(kB, now + 100ms, 1);
  ASSERT_EQ(node->port().transmitter()->port, kB);
  start = now + 1ms;
  for (int i = 0; i < 20 && node->port().transmitter()->port == kB; ++i) {
    start += kInterval;
    at(start + kDelay);
    node->on_event_message(bytes_of(sync_from(kB, sequence)).view(), local(now), local(now));
    take();
    general(message_from(kB, sequence++, ptp::FollowUp{reference(start + 10s)}),
            start + 2 * kDelay);
    const Nanoseconds sent = start + 3 * kDelay;
    for (const ptp::EventId& id : std::exchange(requests, {})) {
      node->on_transmit_timestamp(id, local(sent), local(sent));
      take();
      general(message_from(kB, id.sequence_id, ptp::DelayResp{reference(sent + 10s + kDelay), kUs}),
              sent + 2 * kDelay);
    }
  }
  EXPECT_EQ(places<ptp::TransmitterDoubted>().size(), 1U);
  EXPECT_EQ(node->port().transmitter()->port, kA);
  EXPECT_FALSE(node->locked());
  EXPECT_NEAR(error_ns(), 0.0, 1'000.0) << "nothing was followed";
  cycles(20);
  EXPECT_TRUE(node->locked());
}

TEST_F(Node, peer_to_peer_waits_for_the_delay_of_each_new_link) {
  config.port.delay_mechanism = ptp::DelayMechanism::kPeerToPeer;
  begin();
  announce(kA, 0s);
  announce(kA, 250ms);
  for (int i = 3; i < 10; ++i) sync(kA, i * kInterval);
  EXPECT_TRUE(places<Steered>().empty());
  EXPECT_EQ(node->discipline().counters().commands, 0U);
}

TEST_F(Node, takes_no_memory_but_its_own) {
  lock();
  events.reserve(10'000);
  requests.reserve(10);
  const auto octets = bytes_of(sync_from(kA, sequence));
  const auto follow_up =
      bytes_of(message_from(kA, sequence, ptp::FollowUp{reference(start + kInterval)}));
  at(start + kInterval + kDelay);
  const test::ForbidAllocation none;
  node->on_event_message(octets.view(), local(now), local(now));
  while (node->next()) continue;
  node->on_general_message(follow_up.view(), local(now));
  while (node->next()) continue;
  node->on_timer(local(now));
  while (node->next()) continue;
}

}  // namespace
}  // namespace ftcs::node
