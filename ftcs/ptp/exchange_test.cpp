// SPDX-License-Identifier: MIT
//
// The world: one time transmitter and one time receiver, joined by a network that delays, loses,
// duplicates and reorders messages and loses transmit stamps. The reference shows true time; the
// receiver's free-running clock is 300 ppm fast and began at another time. The world writes down
// when each copy of each event message really left and arrived: a pair is right only if it stands
// in that book.
#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <queue>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/time_receiver.h"
#include "ftcs/ptp/time_transmitter.h"
#include "ftcs/time/rate.h"

namespace ftcs::ptp {
namespace {
using namespace std::chrono_literals;

const PortIdentity kTransmitterPort{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
const PortIdentity kReceiverPort{ClockIdentity::from_mac({2, 0, 0, 0, 0, 2}), 1};

struct Network {
  double loss = 0.0;
  double duplication = 0.0;
  double missing_stamps = 0.0;
  Nanoseconds minimum_delay = 10us;
  Nanoseconds jitter = 0us;       ///< uniform, for each copy: more than the interval reorders
  Nanoseconds stamp_delay = 5us;  ///< until a transmit stamp is known or missed, uniform; of the
                                  ///< missed ones half come at three times that
};

class World {
 public:
  World(const Network& network, std::uint64_t seed, std::int8_t log_interval,
        DelayMechanism mechanism = DelayMechanism::kEndToEnd)
      : network_(network), random_(seed) {
    TimeReceiverConfig receiver;
    receiver.delay_mechanism = transmitter_config_.delay_mechanism = mechanism;
    receiver.peer_delay.log_min_interval = transmitter_config_.peer_delay.log_min_interval =
        log_interval;
    receiver.port = kReceiverPort;
    receiver.log_min_delay_req_interval = log_interval;
    receiver.seed = seed;
    receiver_.emplace(receiver);
    transmitter_config_.port = kTransmitterPort;
    transmitter_config_.log_announce_interval = -2;
    transmitter_config_.log_sync_interval = log_interval;
    transmitter_config_.log_min_delay_req_interval = log_interval;
    at(0ns, [this] { perform(receiver_->start(local())); });
    start_transmitter();
  }

  void start_transmitter() {
    transmitter_.emplace(transmitter_config_);
    ++transmitter_generation_;
    at(now_, [this] { perform_transmitter(transmitter_->start(raw())); });
  }
  void stop_transmitter() { transmitter_.reset(); }
  void link_down() { perform(receiver_->on_link_down(local())); }
  void link_up() { perform(receiver_->on_link_up(local())); }

  void run_until(Nanoseconds end) {
    while (!events_.empty() && events_.top().time <= end) {
      auto event = events_.top();
      events_.pop();
      now_ = event.time;
      event.happen();
      arm();
    }
    now_ = end;
  }

  [[nodiscard]] const TimeReceiver& receiver() const { return *receiver_; }
  [[nodiscard]] const Counters& transmitter_counters() const { return transmitter_->counters(); }
  [[nodiscard]] std::size_t forward_pairs() const { return forward_pairs_; }
  [[nodiscard]] std::size_t backward_pairs() const { return backward_pairs_; }
  [[nodiscard]] std::size_t peer_delays() const { return peer_delays_; }

 private:
  struct Event {
    Nanoseconds time{};
    std::uint64_t order = 0;
    std::function<void()> happen;
    friend bool operator<(const Event& a, const Event& b) {
      return std::tie(a.time, a.order) > std::tie(b.time, b.order);
    }
  };

  void at(Nanoseconds time, std::function<void()> happen) {
    events_.push({time, order_++, std::move(happen)});
  }
  double chance() { return std::uniform_real_distribution<>{}(random_); }
  Nanoseconds uniform(Nanoseconds limit) {
    return Nanoseconds{static_cast<std::int64_t>(chance() * static_cast<double>(limit.count()))};
  }
  /// True time with a fraction that correctionField can carry: 2^-16 ns.
  static ReferenceTime reference(Nanoseconds time) {
    const auto fraction = static_cast<std::uint32_t>(time.count() % 65536) << 16;
    return ReferenceTime{Duration::from_parts(kEpoch + time.count(), fraction)};
  }
  static FreeRunningTime local_at(Nanoseconds time) {
    return FreeRunningTime{scale(Duration{time}, Rate::from_ppm(300.0)) + Duration{5s}};
  }
  [[nodiscard]] FreeRunningTime local() const { return local_at(now_); }
  [[nodiscard]] FreeRunningTime raw() const { return FreeRunningTime{Duration{now_}}; }

  /// Timers: on_timer is called whenever a deadline has come.
  void arm() {
    if (const auto due = receiver_->deadline()) {
      Nanoseconds time{(*due - local()).floor_ns() + 1};
      time = now_ + std::max(time, 0ns);
      if (time != receiver_timer_) {
        receiver_timer_ = time;
        at(time, [this, time] {
          if (receiver_timer_ != time) return;  // superseded
          receiver_timer_ = -1ns;
          const auto deadline = receiver_->deadline();
          if (deadline && *deadline <= local()) perform(receiver_->on_timer(local()));
        });
      }
    }
    if (!transmitter_ || !transmitter_->deadline()) return;
    const auto time =
        std::max(Nanoseconds{(transmitter_->deadline()->since_epoch()).floor_ns()}, now_);
    if (time == transmitter_timer_) return;
    transmitter_timer_ = time;
    at(time, [this, time] {
      if (transmitter_timer_ != time) return;
      transmitter_timer_ = -1ns;
      if (transmitter_) perform_transmitter(transmitter_->on_timer(raw()));
    });
  }

  std::vector<Nanoseconds> arrivals() {
    std::vector<Nanoseconds> times;
    if (chance() >= network_.loss)
      times.push_back(now_ + network_.minimum_delay + uniform(network_.jitter));
    if (chance() < network_.duplication) {
      times.push_back(now_ + network_.minimum_delay + uniform(network_.jitter));
    }
    return times;
  }

  void perform_transmitter(const ActionList& actions) {
    for (const Action& action : actions) {
      if (const auto* delay = std::get_if<EmitPeerDelay>(&action)) check(*delay);
      const auto* send = std::get_if<SendMessage>(&action);
      if (send == nullptr) continue;
      const auto message = *send;
      const bool event = message.channel == Channel::kEvent;
      const ReferenceTime sent = reference(now_);
      for (const auto time : arrivals()) {
        if (event) sync_book_.insert({sent, local_at(time)});
        at(time, [this, message, event] {
          const auto bytes = message.bytes.view();
          perform(event ? receiver_->on_event_message(bytes, local(), local())
                        : receiver_->on_general_message(bytes, local()));
        });
      }
      if (!event) continue;
      const bool missing = chance() < network_.missing_stamps;
      const int generation = transmitter_generation_;
      const auto give = [this, message, sent, generation](bool stamp) {
        if (!transmitter_ || generation != transmitter_generation_) return;
        perform_transmitter(stamp
                                ? transmitter_->on_transmit_timestamp(message.id(), sent, raw())
                                : transmitter_->on_transmit_timestamp_missing(message.id(), raw()));
      };
      at(now_ + uniform(network_.stamp_delay), [give, missing] { give(!missing); });
      if (missing && chance() < 0.5) at(now_ + 3 * network_.stamp_delay, [give] { give(true); });
    }
  }

  void perform(const ActionList& actions) {
    for (const Action& action : actions) {
      if (const auto* send = std::get_if<SendMessage>(&action)) send_from_receiver(*send);
      if (const auto* delay = std::get_if<EmitPeerDelay>(&action)) check(*delay);
      if (const auto* emit = std::get_if<EmitPair>(&action)) check(emit->pair);
      EXPECT_FALSE(std::holds_alternative<ReferenceJumped>(action))
          << "the reference never jumps here";
    }
  }

  void send_from_receiver(const SendMessage message) {
    const FreeRunningTime sent = local();
    const bool event = message.channel == Channel::kEvent;
    for (const auto time : arrivals()) {
      if (event) request_book_.insert({sent, reference(time)});
      at(time, [this, message, event] {
        if (!transmitter_) return;
        const auto bytes = message.bytes.view();
        perform_transmitter(event ? transmitter_->on_event_message(bytes, reference(now_), raw())
                                  : transmitter_->on_general_message(bytes, raw()));
      });
    }
    if (!event) return;
    const bool missing = chance() < network_.missing_stamps;
    const auto give = [this, message, sent](bool stamp) {
      perform(stamp ? receiver_->on_transmit_timestamp(message.id(), sent, local())
                    : receiver_->on_transmit_timestamp_missing(message.id(), local()));
    };
    at(now_ + uniform(network_.stamp_delay), [give, missing] { give(!missing); });
    if (missing && chance() < 0.5) at(now_ + 3 * network_.stamp_delay, [give] { give(true); });
  }

  void check(const EventPair& pair) {
    if (pair.direction == Direction::kForward) {
      ++forward_pairs_;
      ASSERT_GT(pair.reference, last_origin_) << "forward pairs in order";
      last_origin_ = pair.reference;
      ASSERT_TRUE(sync_book_.contains({pair.reference, pair.free_running}))
          << "a wrong forward pair";
    } else {
      ++backward_pairs_;
      ASSERT_GT(pair.free_running, last_request_) << "backward pairs in order";
      last_request_ = pair.free_running;
      ASSERT_TRUE(request_book_.contains({pair.free_running, pair.reference}))
          << "a wrong backward pair";
    }
  }

  /// With stamps of one exchange the delay lies between that of the fastest message and that of the
  /// slowest, and what 300 ppm make of the turn-around; with stamps of two it is off by parts of a
  /// second.
  void check(const EmitPeerDelay& delay) {
    ++peer_delays_;
    const double turn_around_ns = 2.0 * static_cast<double>(network_.stamp_delay.count());
    const double rate_error_ns =
        (turn_around_ns + static_cast<double>(network_.jitter.count())) * 1e-3;
    const double least = static_cast<double>(network_.minimum_delay.count());
    ASSERT_GT(delay.mean_link_delay.ns(), least - rate_error_ns - 100.0) << "a wrong peer delay";
    ASSERT_LT(delay.mean_link_delay.ns(),
              least + static_cast<double>(network_.jitter.count()) + rate_error_ns + 100.0)
        << "a wrong peer delay";
  }

  static constexpr std::int64_t kEpoch = 1'800'000'000'000'000'000;

  Network network_;
  std::mt19937_64 random_;
  std::optional<TimeReceiver> receiver_;
  TimeTransmitterConfig transmitter_config_;
  std::optional<TimeTransmitter> transmitter_;
  int transmitter_generation_ = 0;
  std::priority_queue<Event> events_;
  std::uint64_t order_ = 0;
  Nanoseconds now_{};
  Nanoseconds receiver_timer_{-1};
  Nanoseconds transmitter_timer_{-1};
  std::set<std::pair<ReferenceTime, FreeRunningTime>> sync_book_;
  std::set<std::pair<FreeRunningTime, ReferenceTime>> request_book_;
  ReferenceTime last_origin_;
  FreeRunningTime last_request_;
  std::size_t forward_pairs_ = 0;
  std::size_t backward_pairs_ = 0;
  std::size_t peer_delays_ = 0;  ///< of both ends
};

TEST(Exchange, a_quiet_network_gives_a_pair_for_every_message) {
  World world({}, 1, -3);
  world.run_until(30s);
  const auto& counters = world.receiver().counters();
  EXPECT_EQ(world.receiver().state(), PortState::kUncalibrated);
  EXPECT_NEAR(static_cast<double>(world.forward_pairs()), 30.0 * 8.0, 5.0);
  EXPECT_NEAR(static_cast<double>(world.backward_pairs()), 30.0 * 8.0, 40.0);
  EXPECT_EQ(world.forward_pairs(), counters[Counter::kForwardPairs]);
  for (const auto counter : {Counter::kLostFollowUp, Counter::kLostSync, Counter::kLostDelayResp,
                             Counter::kStaleSync, Counter::kMissedSync, Counter::kActionsDropped}) {
    EXPECT_EQ(counters[counter], 0U) << to_string(counter);
  }
}

TEST(Exchange, follow_ups_may_lag_behind_by_more_than_an_interval) {
  Network network;
  network.stamp_delay = 16ms;  // two intervals of 1/128 s
  World world(network, 1, -7);
  world.run_until(10s);
  EXPECT_GT(world.forward_pairs(), 700U);
}

TEST(Exchange, no_mishap_of_the_network_makes_a_wrong_pair) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<> unit;
    Network network;
    network.loss = 0.3 * unit(random);
    network.duplication = 0.3 * unit(random);
    network.missing_stamps = 0.2 * unit(random);
    network.jitter = Nanoseconds{static_cast<std::int64_t>(3e8 * unit(random) * unit(random))};
    network.stamp_delay = Nanoseconds{static_cast<std::int64_t>(1e8 * unit(random) * unit(random))};
    const auto log_interval = static_cast<std::int8_t>(-static_cast<int>(seed % 6));
    World world(network, seed, log_interval);
    world.run_until(15s);
    world.stop_transmitter();
    world.run_until(17s + Nanoseconds{static_cast<std::int64_t>(random() % 3'000'000'000)});
    world.start_transmitter();
    world.run_until(30s);
    world.link_down();
    world.run_until(31s);
    world.link_up();
    world.run_until(45s);
    EXPECT_GT(world.forward_pairs(), 3U);
    EXPECT_GT(world.backward_pairs(), 3U);
    EXPECT_EQ(world.receiver().counters()[Counter::kActionsDropped], 0U);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Exchange, peer_to_peer_both_ends_measure_the_link) {
  World world({}, 1, -3, DelayMechanism::kPeerToPeer);
  world.run_until(30s);
  EXPECT_NEAR(static_cast<double>(world.forward_pairs()), 30.0 * 8.0, 5.0);
  EXPECT_EQ(world.backward_pairs(), 0U);
  EXPECT_NEAR(static_cast<double>(world.peer_delays()), 2.0 * 30.0 * 8.0, 10.0);
  EXPECT_NEAR(world.receiver().peer_delay().mean_link_delay()->ns(), 10'000.0, 1.0);
  EXPECT_NEAR(world.receiver().peer_delay().neighbor_rate_ratio().inverse().ppm(), 300.0, 0.1);
  for (const auto counter :
       {Counter::kLostPdelayResp, Counter::kStalePdelayResp, Counter::kMissingTransmitStamp,
        Counter::kPdelayIgnored, Counter::kActionsDropped}) {
    EXPECT_EQ(world.receiver().counters()[counter], 0U) << to_string(counter);
    EXPECT_EQ(world.transmitter_counters()[counter], 0U) << to_string(counter);
  }
}

TEST(Exchange, no_mishap_of_the_network_makes_a_wrong_peer_delay) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<> unit;
    Network network;
    network.loss = 0.3 * unit(random);
    network.duplication = 0.3 * unit(random);
    network.missing_stamps = 0.2 * unit(random);
    network.jitter = Nanoseconds{static_cast<std::int64_t>(1e7 * unit(random) * unit(random))};
    network.stamp_delay = Nanoseconds{static_cast<std::int64_t>(1e8 * unit(random) * unit(random))};
    const auto log_interval = static_cast<std::int8_t>(-static_cast<int>(seed % 4));
    World world(network, seed, log_interval, DelayMechanism::kPeerToPeer);
    world.run_until(15s);
    world.stop_transmitter();
    world.run_until(17s);
    world.start_transmitter();
    world.run_until(30s);
    world.link_down();
    world.run_until(31s);
    world.link_up();
    world.run_until(45s);
    EXPECT_GT(world.forward_pairs(), 3U);
    EXPECT_GT(world.peer_delays(), 10U);
    EXPECT_EQ(world.receiver().counters()[Counter::kActionsDropped], 0U);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace ftcs::ptp
