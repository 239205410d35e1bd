// SPDX-License-Identifier: MIT
// World: the shipped receiver, copied at each branch, under every order of a few inputs up to a
// depth (FTCS_EXPLORE_DEPTH; 5 unless it is given): messages of two transmitters, loss (an input
// that does not come), time-outs, the link, the servo, doubt. After each input the invariants;
// after each order what must always be possible: to be found again, and to be left.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>

#include "test/support/receiver_fixture.h"

namespace ftcs::ptp::receiver_test {
namespace {

enum class Step : std::uint8_t {
  kAnnounceBetter,
  kAnnounceOther,
  kSyncBetter,
  kFollowUpBetter,
  kSyncOther,
  kTick,     // half a second
  kSilence,  // longer than any receipt time-out
  kLinkDown,
  kLinkUp,
  kLocked,
  kUnlocked,
  kDoubt,
};
constexpr std::array kSteps = {Step::kAnnounceBetter, Step::kAnnounceOther, Step::kSyncBetter,
                               Step::kFollowUpBetter, Step::kSyncOther,     Step::kTick,
                               Step::kSilence,        Step::kLinkDown,      Step::kLinkUp,
                               Step::kLocked,         Step::kUnlocked,      Step::kDoubt};

struct World {
  TimeReceiver receiver;
  Nanoseconds now{0};
  std::uint16_t sequence = 0;
  bool doubted = false;  ///< somebody was, and is perhaps not forgiven yet
};

const MessageBytes& announce_of(const PortIdentity& who) {
  static const MessageBytes better = bytes_of(announce_from(kA, 100));
  static const MessageBytes other = bytes_of(announce_from(kB, 200));
  return who == kA ? better : other;
}

using Edge = std::pair<PortState, PortState>;

class Exploration : public testing::TestWithParam<bool> {
 protected:
  void note(const World& world, const ActionList& actions) {
    for (const auto& change : of<PortStateChanged>(actions)) ++edges_[{change.from, change.to}];
    const PortState state = world.receiver.state();
    const bool follows = state == PortState::kUncalibrated || state == PortState::kTimeReceiver;
    if (follows != (world.receiver.transmitter() != nullptr)) ++wrong_;
    if (world.receiver.counters()[Counter::kActionsDropped] > 0) ++wrong_;
    if (state == PortState::kTimeTransmitter || state == PortState::kPassive) ++wrong_;
    ++states_;
  }
  void hear(World& world, const MessageBytes& bytes, bool event) {
    const FreeRunningTime at = local(world.now);
    note(world, event ? world.receiver.on_event_message(bytes.view(), at, at)
                      : world.receiver.on_general_message(bytes.view(), at));
  }
  /// Timers are run when they are due, as the shell does.
  void pass(World& world, Nanoseconds time) {
    const Nanoseconds until = world.now + time;
    for (int turns = 0; turns < 400; ++turns) {
      const auto due = world.receiver.deadline();
      if (!due || *due > local(until)) break;
      const Nanoseconds at{(*due - local(0s)).floor_ns() + 1};
      world.now = std::max(world.now, at);
      note(world, world.receiver.on_timer(local(world.now)));
    }
    world.now = std::max(world.now, until);
  }
  void sync(World& world, const PortIdentity& who, bool with_follow_up) {
    hear(world, bytes_of(sync_from(who, world.sequence)), true);
    if (!with_follow_up) return;
    Message follow = message_from(who, world.sequence++, FollowUp{reference(world.now)});
    hear(world, bytes_of(follow), false);
  }
  void take(World& world, Step step) {
    const FreeRunningTime at = local(world.now);
    switch (step) {
      case Step::kAnnounceBetter:
        return hear(world, announce_of(kA), false);
      case Step::kAnnounceOther:
        return hear(world, announce_of(kB), false);
      case Step::kSyncBetter:
        return sync(world, kA, false);
      case Step::kFollowUpBetter:
        return hear(world, bytes_of(follow_up_of_a(world)), false);
      case Step::kSyncOther:
        return sync(world, kB, true);
      case Step::kTick:
        return pass(world, 500ms);
      case Step::kSilence:
        return pass(world, 30s);
      case Step::kLinkDown:
        return note(world, world.receiver.on_link_down(at));
      case Step::kLinkUp:
        return note(world, world.receiver.on_link_up(at));
      case Step::kLocked:
        return note(world, world.receiver.on_servo_locked(at));
      case Step::kUnlocked:
        return note(world, world.receiver.on_servo_unlocked(at));
      case Step::kDoubt:
        world.doubted = true;
        return note(world, world.receiver.on_transmitter_doubted(at));
    }
  }
  static Message follow_up_of_a(World& world) {
    return message_from(kA, world.sequence++, FollowUp{reference(world.now)});
  }
  void explore(const World& world, int depth) {
    if (depth == 0) return;
    for (const Step step : kSteps) {
      World next = world;
      take(next, step);
      explore(next, depth - 1);
      if (depth == 1) {
        ++orders_;
        can_be_left(next);
        finds_the_best(next);
      }
    }
  }
  /// Nobody speaks any more: nothing is followed for ever.
  void can_be_left(World world) {
    pass(world, 60s);
    const PortState state = world.receiver.state();
    if (state != PortState::kListening && state != PortState::kFaulty) ++stuck_;
  }
  /// Both speak, the link is there: the better one is followed, its pairs come, and the lock
  /// counts.
  void finds_the_best(World world) {
    note(world, world.receiver.on_link_up(local(world.now)));
    if (world.doubted) pass(world, Nanoseconds{301s});
    std::size_t pairs = 0;
    for (int second = 0; second < 5; ++second) {
      hear(world, announce_of(kB), false);
      hear(world, announce_of(kA), false);
      hear(world, bytes_of(sync_from(kA, world.sequence)), true);
      const auto bytes = bytes_of(follow_up_of_a(world));
      const FreeRunningTime at = local(world.now);
      const auto actions = world.receiver.on_general_message(bytes.view(), at);
      note(world, actions);
      if (second >= 3) pairs += of<EmitPair>(actions).size();
      pass(world, 1s);
    }
    note(world, world.receiver.on_servo_locked(local(world.now)));
    const TransmitterData* const followed = world.receiver.transmitter();
    const bool found = followed != nullptr && followed->port == kA && pairs > 0 &&
                       world.receiver.state() == PortState::kTimeReceiver;
    if (!found) ++lost_;
  }

  std::map<Edge, std::uint64_t> edges_;
  std::uint64_t states_ = 0;
  std::uint64_t orders_ = 0;
  std::uint64_t wrong_ = 0;
  std::uint64_t stuck_ = 0;
  std::uint64_t lost_ = 0;
};

TEST_P(Exploration, every_order_of_inputs_keeps_the_rules_and_leads_back) {
  const char* const given = std::getenv("FTCS_EXPLORE_DEPTH");
  const int depth = given == nullptr ? 5 : std::atoi(given);
  TimeReceiverConfig config;
  config.port = kUs;
  config.log_announce_interval = 0;
  config.log_min_delay_req_interval = 0;
  config.fast_start = GetParam();
  World world{TimeReceiver(config)};
  static_cast<void>(world.receiver.start(local(0s)));
  explore(world, depth);
  EXPECT_EQ(wrong_, 0U) << "states and transmitters that do not belong together";
  EXPECT_EQ(stuck_, 0U) << "of " << orders_ << " orders: a port that nobody's silence ends";
  EXPECT_EQ(lost_, 0U) << "of " << orders_ << " orders: the better transmitter is not followed";
  const std::array<Edge, 8> possible = {{{PortState::kListening, PortState::kUncalibrated},
                                         {PortState::kUncalibrated, PortState::kTimeReceiver},
                                         {PortState::kTimeReceiver, PortState::kUncalibrated},
                                         {PortState::kUncalibrated, PortState::kListening},
                                         {PortState::kTimeReceiver, PortState::kListening},
                                         {PortState::kListening, PortState::kFaulty},
                                         {PortState::kUncalibrated, PortState::kFaulty},
                                         {PortState::kFaulty, PortState::kListening}}};
  for (const Edge& edge : possible) EXPECT_GT(edges_[edge], 0U) << "never taken: not explored";
  for (const auto& [edge, times] : edges_) {
    const bool usual = std::ranges::find(possible, edge) != possible.end() ||
                       edge == Edge{PortState::kTimeReceiver, PortState::kFaulty};
    EXPECT_TRUE(usual) << static_cast<int>(edge.first) << " to " << static_cast<int>(edge.second);
  }
  RecordProperty("orders", std::to_string(orders_));
  RecordProperty("states", std::to_string(states_));
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutFastStart, Exploration, testing::Bool());

// Up to four transmitters, every order of two Announces of each: whoever comes when, the best is
// selected once all are qualified.
TEST(Selection, is_the_same_for_every_order_of_announces) {
  for (int transmitters = 2; transmitters <= 4; ++transmitters) {
    std::vector<int> order;
    for (int i = 0; i < transmitters; ++i) order.insert(order.end(), {i, i});
    std::size_t orders = 0;
    do {
      TimeReceiverConfig config;
      config.port = kUs;
      TimeReceiver receiver(config);
      static_cast<void>(receiver.start(local(0s)));
      Nanoseconds now{0};
      for (const int who : order) {
        const PortIdentity port{
            ClockIdentity::from_mac({2, 0, 0, 0, 1, static_cast<std::uint8_t>(9 - who)}), 1};
        const auto bytes = bytes_of(announce_from(port, static_cast<std::uint8_t>(100 + 10 * who)));
        static_cast<void>(receiver.on_general_message(bytes.view(), local(now += 50ms)));
      }
      ASSERT_NE(receiver.transmitter(), nullptr);
      ASSERT_EQ(receiver.transmitter()->announce.priority1, 100);
      ++orders;
    } while (std::ranges::next_permutation(order).found);
    EXPECT_EQ(orders, transmitters == 2 ? 6U : transmitters == 3 ? 90U : 2520U);
  }
}

}  // namespace
}  // namespace ftcs::ptp::receiver_test
