// SPDX-License-Identifier: MIT
// World: a crystal off by up to 50 ppm that wanders by 1e-9 per square root of a second, hardware
// stamps of both ends rounded down to 8 ns, a cable of 500 ns, nothing else: 125 ms, 480 exchanges.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"
#include "test/support/manual_source.h"

namespace ftcs {
namespace {

constexpr double kInterval = 125e6, kCable = 500.0, kTick = 8.0;

struct Outcome {
  int lost = 0;              ///< locks
  int refused_in_a_row = 0;  ///< Syncs, most
};

class World {
 public:
  explicit World(std::uint64_t seed) : random_(seed) {
    rate_ = 1.0 + 50e-6 * (2.0 * std::uniform_real_distribution<double>()(random_) - 1.0);
    oscillator_.instant = FreeRunningTime::from_ns(1'000'000'000);
    clock_.emplace(oscillator_, VirtualClockConfig{.free_running = oscillator_.instant,
                                                   .local = LocalTime{Duration::from_ns(50e3)},
                                                   .limits = RateLimits{}});
    DisciplineConfig config;
    config.servo.sync_interval = Nanoseconds{static_cast<std::int64_t>(kInterval)};
    discipline_.emplace(config, *clock_);
  }
  Outcome run(int cycles) {
    const double phase = std::uniform_real_distribution<double>(0.0, kInterval)(random_);
    for (int n = 1; n <= cycles; ++n) {
      const double sync = phase + n * kInterval;
      hear(Direction::kForward, sync, sync + kCable, sync + kCable);
      const double request = sync + kInterval / 3.0;
      hear(Direction::kBackward, request + kCable, request, request + kCable + 20e3);
    }
    return outcome_;
  }

 private:
  static std::int64_t on_tick(double ns) {
    return static_cast<std::int64_t>(std::floor(ns / kTick) * kTick);
  }
  /// The crystal's reading; it wanders from one exchange to the next.
  double reading(double t) {
    if (t > time_) {
      shown_ += (t - time_) * rate_;
      rate_ += 1e-9 * std::sqrt((t - time_) * 1e-9) * std::normal_distribution<double>()(random_);
      time_ = t;
    }
    return shown_ - (time_ - t) * rate_;
  }
  void hear(Direction direction, double reference, double local, double known) {
    const double read_before = reading(std::min(local, known));
    const EventPair pair{direction, ReferenceTime::from_ns(on_tick(reference)),
                         FreeRunningTime::from_ns(on_tick(read_before))};
    oscillator_.instant = FreeRunningTime{Duration::from_ns(reading(known))};
    const Telemetry telemetry = discipline_->on_pair(pair);
    if (direction == Direction::kForward) {
      refused_ = telemetry.verdict == SampleVerdict::kRejected ? refused_ + 1 : 0;
      outcome_.refused_in_a_row = std::max(outcome_.refused_in_a_row, refused_);
    }
    if (was_locked_ && !telemetry.locked) ++outcome_.lost;
    was_locked_ = telemetry.locked;
  }

  std::mt19937_64 random_;
  double rate_ = 1.0, time_ = 0.0, shown_ = 1e9;
  test::ManualSource oscillator_;
  std::optional<VirtualClock> clock_;
  std::optional<ClockDiscipline> discipline_;
  Outcome outcome_{};
  int refused_ = 0;
  bool was_locked_ = false;
};

// A crystal whose rate is a multiple of the tick per interval gives stamps that agree to the digit
// for seconds. With a learnt noise below what rounding makes, the first step of a tick was refused
// eight times in a row in six of these runs.
TEST(CoarseStamps, neither_cost_the_lock_nor_are_refused_for_long) {
  Outcome all;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const Outcome one = World(seed).run(480);
    all.lost += one.lost;
    all.refused_in_a_row = std::max(all.refused_in_a_row, one.refused_in_a_row);
  }
  EXPECT_EQ(all.lost, 0);
  EXPECT_LE(all.refused_in_a_row, 2);
}

}  // namespace
}  // namespace ftcs
