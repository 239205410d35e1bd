// SPDX-License-Identifier: MIT
//
// The world: the shipped time transmitter and receiver node exchange octets over a link of 10 us;
// the node steers a virtual clock that starts 1 ms off on an oscillator that is 50 ppm fast. The
// transmitter shows true time. Nothing is lost, no stamp has noise: what is shown is how soon
// everything is known.
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/node/receiver_node.h"
#include "ftcs/ptp/time_transmitter.h"
#include "ftcs/sim/event_queue.h"
#include "ftcs/sim/settable_source.h"

namespace ftcs::sim {
namespace {
using namespace std::chrono_literals;

constexpr Nanoseconds kLink = 10us;
constexpr Nanoseconds kStampLatency = 20us;
constexpr Nanoseconds kEpoch = 1'800'000'000s;

struct Start {
  ptp::DelayMechanism mechanism = ptp::DelayMechanism::kEndToEnd;
  ServoKind servo = ServoKind::kFtcs;
  bool fast = true;
  std::int8_t log_announce_interval = -3;  ///< Sync comes at 2^-3 s
  Nanoseconds joins = 0ns;  ///< when the receiver starts; the transmitter runs since 0
};

class World {
 public:
  explicit World(const Start& start) : start_(start), receiver_(receiver_config(start), clock_) {
    ptp::TimeTransmitterConfig transmitter;
    transmitter.port = {ptp::ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
    transmitter.delay_mechanism = start.mechanism;
    transmitter.log_sync_interval = -3;
    transmitter.log_announce_interval = start.log_announce_interval;
    transmitter.log_min_delay_req_interval = -3;
    transmitter_.emplace(transmitter);
    at(0ns, [this] { transmit(transmitter_->start(raw())); });
    at(start.joins, [this] {
      receiver_.start(local());
      receive();
    });
  }

  void run_until(Nanoseconds end) {
    while (now_ < end) {
      const Nanoseconds next = std::min(next_timer(), end);
      while (!queue_.empty() && queue_.next_time() <= TrueTime{Duration{next}}) {
        const auto entry = queue_.pop();
        now_ = Nanoseconds{entry.time.since_epoch().floor_ns()};
        oscillator_.set(local());
        entry.event();
      }
      now_ = next;
      oscillator_.set(local());
      if (transmitter_->deadline() && *transmitter_->deadline() <= raw()) {
        transmit(transmitter_->on_timer(raw()));
      }
      if (receiver_.deadline() && *receiver_.deadline() <= local()) {
        receiver_.on_timer(local());
        receive();
      }
    }
  }

  /// True error of the steered clock, ns.
  [[nodiscard]] double error_ns() const {
    return (clock_.local_at(local()).since_epoch() - reference().since_epoch()).ns();
  }
  [[nodiscard]] std::optional<Nanoseconds> first_sync() const { return first_sync_; }

 private:
  static node::ReceiverNodeConfig receiver_config(const Start& start) {
    node::ReceiverNodeConfig config;
    config.port.port = {ptp::ClockIdentity::from_mac({2, 0, 0, 0, 0, 2}), 1};
    config.port.delay_mechanism = start.mechanism;
    config.port.log_min_delay_req_interval = -3;
    config.port.fast_start = start.fast;
    config.follower.discipline.servo.kind = start.servo;
    config.follower.discipline.servo.ftcs.converged_dwell = 4;  // as ftcs ptp
    return config;
  }
  static VirtualClockConfig clock_config() {
    VirtualClockConfig config;
    config.free_running = local_at(0ns);
    config.local = LocalTime{Duration{kEpoch + 1ms}};
    return config;
  }
  static FreeRunningTime local_at(Nanoseconds time) {
    return FreeRunningTime{scale(Duration{time}, Rate::from_ppm(50.0)) + Duration{5s}};
  }
  [[nodiscard]] FreeRunningTime local() const { return local_at(now_); }
  [[nodiscard]] FreeRunningTime raw() const { return FreeRunningTime{Duration{now_}}; }
  [[nodiscard]] ReferenceTime reference() const { return ReferenceTime{Duration{now_ + kEpoch}}; }
  void at(Nanoseconds time, std::function<void()> happen) {
    queue_.schedule(TrueTime{Duration{time}}, std::move(happen));
  }
  /// The next moment at which something is due; a nanosecond more on the oscillator's slower side.
  [[nodiscard]] Nanoseconds next_timer() const {
    constexpr Nanoseconds kStep = 1ms;
    Nanoseconds next = now_ + kStep;
    if (!queue_.empty()) {
      next = std::min(next, Nanoseconds{queue_.next_time().since_epoch().floor_ns()});
    }
    return std::max(next, now_);
  }

  void transmit(const ptp::ActionList& actions) {
    for (const ptp::Action& action : actions) {
      const auto* sent = std::get_if<ptp::SendMessage>(&action);
      if (sent == nullptr) continue;
      at(now_ + kLink, [this, message = *sent] {
        if (now_ < start_.joins) return;
        if (message.type == ptp::MessageType::kSync && !first_sync_) first_sync_ = now_;
        const auto bytes = message.bytes.view();
        if (message.channel == ptp::Channel::kEvent) {
          receiver_.on_event_message(bytes, local(), local());
        } else {
          receiver_.on_general_message(bytes, local());
        }
        receive();
      });
      if (sent->channel != ptp::Channel::kEvent) continue;
      at(now_ + kStampLatency, [this, id = sent->id(), stamp = reference()] {
        transmit(transmitter_->on_transmit_timestamp(id, stamp, raw()));
      });
    }
  }
  /// What the node brought about.
  void receive() {
    while (const auto event = receiver_.next()) {
      const auto* action = std::get_if<ptp::Action>(&*event);
      const auto* sent = action != nullptr ? std::get_if<ptp::SendMessage>(action) : nullptr;
      if (sent != nullptr) answer(*sent);
    }
  }
  void answer(const ptp::SendMessage& sent) {
    at(now_ + kLink, [this, message = sent] {
      const auto bytes = message.bytes.view();
      transmit(message.channel == ptp::Channel::kEvent
                   ? transmitter_->on_event_message(bytes, reference(), raw())
                   : transmitter_->on_general_message(bytes, raw()));
    });
    if (sent.channel != ptp::Channel::kEvent) return;
    at(now_ + kStampLatency, [this, id = sent.id(), stamp = local()] {
      receiver_.on_transmit_timestamp(id, stamp, local());
      receive();
    });
  }

  Start start_;
  Nanoseconds now_{};
  SettableSource oscillator_;
  VirtualClock clock_{oscillator_, clock_config()};
  node::ReceiverNode receiver_;
  std::optional<ptp::TimeTransmitter> transmitter_;
  EventQueue<std::function<void()>> queue_;
  std::optional<Nanoseconds> first_sync_;
};

constexpr Nanoseconds kSyncInterval = 125ms;
constexpr double kBandNs = 1'000.0;

/// How many Sync intervals after the first Sync the clock is and stays within the band.
double intervals_to_lock(const Start& start) {
  World world(start);
  for (Nanoseconds now = start.joins; !world.first_sync(); now += 1ms) world.run_until(now);
  double locked = -1.0;
  for (int tenth = 0; tenth < 200; ++tenth) {
    world.run_until(*world.first_sync() + tenth * kSyncInterval / 10);
    const bool inside = std::abs(world.error_ns()) < kBandNs;
    if (!inside) locked = -1.0;
    if (inside && locked < 0.0) locked = tenth / 10.0;
  }
  return locked;
}

TEST(FastStart, locks_within_two_sync_intervals_of_the_first_sync_whenever_the_receiver_joins) {
  for (const auto mechanism : {ptp::DelayMechanism::kEndToEnd, ptp::DelayMechanism::kPeerToPeer}) {
    for (const auto servo : {ServoKind::kFtcs, ServoKind::kAdaptive}) {
      for (const Nanoseconds joins : {0ms, 1ms, 30ms, 60ms, 99ms, 124ms, 1'050ms}) {
        SCOPED_TRACE(testing::Message()
                     << servo_kind_name(servo) << " joins after " << joins.count()
                     << " ns, mechanism " << static_cast<int>(mechanism));
        const double intervals = intervals_to_lock({mechanism, servo, true, -3, joins});
        EXPECT_GE(intervals, 0.0) << "never locked";
        EXPECT_LE(intervals, 2.0);
      }
    }
  }
}

TEST(FastStart, what_was_kept_makes_up_for_an_announce_that_comes_late) {
  // Announce every second, eight Syncs in between: one interval after it the clock is there.
  const Start late{ptp::DelayMechanism::kEndToEnd, ServoKind::kFtcs, true, 0, 50ms};
  const double announce_after_first_sync = (1'000.0 - 125.0) / 125.0;
  const double intervals = intervals_to_lock(late);
  EXPECT_GT(intervals, announce_after_first_sync);
  EXPECT_LE(intervals, announce_after_first_sync + 1.0);
}

TEST(FastStart, without_it_a_second_announce_is_waited_for) {
  Start slow{ptp::DelayMechanism::kEndToEnd, ServoKind::kFtcs, false, 0, 50ms};
  EXPECT_GT(intervals_to_lock(slow), 15.0);
}

}  // namespace
}  // namespace ftcs::sim
