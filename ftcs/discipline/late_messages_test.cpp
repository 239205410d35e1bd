// SPDX-License-Identifier: MIT
// World: a perfect oscillator 50 ppm fast, a reference, a virtual clock that the adaptive servo
// steers, stamps of whole nanoseconds. Messages of both directions come late by laws of software
// stamps on a busy host: a share of them waits for nothing, or runs of messages wait alike.
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
using namespace std::chrono_literals;

/// How messages are late: a share waits for nothing, the others evenly up to `longest_ns` or, with
/// a mean, exponentially; `run`: so many in a row of one direction wait alike, on the average.
struct Law {
  const char* name;
  double clean;
  double longest_ns;
  double mean_ns;
  double jitter_ns;
  double run;
};

struct Outcome {
  bool locked = false;
  int lost = 0;      ///< locks lost while the true error was within the lock limit
  int rejected = 0;  ///< messages
  int messages = 0;
  std::uint64_t holdovers = 0;
  double worst_ns = 0.0;  ///< true error in the second half
};

class World {
 public:
  World(const Law& law, Duration interval, std::uint64_t seed)
      : law_(law), interval_(interval), random_(seed) {
    oscillator_.instant = FreeRunningTime::from_ns(1'000'000'000);
    clock_.emplace(oscillator_, VirtualClockConfig{.free_running = oscillator_.instant,
                                                   .local = LocalTime{Duration{1ms}},
                                                   .limits = RateLimits::symmetric_ppb(30e6)});
    discipline_.emplace(DisciplineConfig{}, *clock_);
  }

  Outcome run(int cycles) {
    for (int n = 1; n <= cycles; ++n) {
      const double sync = n * interval_.ns();
      message(Direction::kForward, sync, n > cycles / 2);
      const double request = sync + interval_.ns() * uniform(0.05, 0.95);
      message(Direction::kBackward, request, n > cycles / 2);
    }
    outcome_.holdovers = discipline_->counters().holdovers;
    outcome_.locked = discipline_->locked();
    return outcome_;
  }

 private:
  static constexpr double kDelay = 100.0;
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double wait(Direction direction) {
    double& latest = waits_[direction];
    if (law_.run > 1.0 && uniform(0.0, 1.0) > 1.0 / law_.run) return latest;
    if (uniform(0.0, 1.0) < law_.clean) {
      latest = 0.0;
    } else if (law_.mean_ns > 0.0) {
      latest = -law_.mean_ns * std::log(uniform(1e-9, 1.0));
    } else {
      latest = uniform(10.0, law_.longest_ns);
    }
    return latest;
  }
  /// The oscillator's reading when the reference shows so many ns.
  static FreeRunningTime reading(double reference_ns) {
    return FreeRunningTime::from_ns(
        static_cast<std::int64_t>(std::llround(1e9 + reference_ns * (1.0 + 50e-6))));
  }
  void message(Direction direction, double sent, bool judged) {
    double delay = kDelay + wait(direction);
    if (law_.jitter_ns > 0.0)
      delay += std::normal_distribution<double>(0.0, law_.jitter_ns)(random_);
    const double arrived = sent + delay;
    const bool forward = direction == Direction::kForward;
    const double referenced = forward ? sent : arrived;
    const EventPair pair{direction, ReferenceTime::from_ns(std::llround(referenced)),
                         reading(forward ? arrived : sent)};
    oscillator_.instant = reading(arrived + 20e3);
    const Telemetry telemetry = discipline_->on_pair(pair);
    const double error = clock_->read().local.since_epoch().ns() - (arrived + 20e3);
    ++outcome_.messages;
    if (telemetry.verdict == SampleVerdict::kRejected) ++outcome_.rejected;
    if (was_locked_ && !telemetry.locked && std::abs(error) < 10e3) ++outcome_.lost;
    was_locked_ = telemetry.locked;
    if (!judged) return;
    outcome_.worst_ns = std::max(outcome_.worst_ns, std::abs(error));
  }

  Law law_;
  Duration interval_;
  std::mt19937_64 random_;
  PerDirection<double> waits_{};
  test::ManualSource oscillator_;
  std::optional<VirtualClock> clock_;
  std::optional<ClockDiscipline> discipline_;
  Outcome outcome_{};
  bool was_locked_ = false;
};

constexpr Law kLaws[] = {
    {"bursts, 30 % clean", 0.3, 400.0, 0.0, 0.0, 6.0},
    {"bursts, nothing clean", 0.0, 400.0, 0.0, 0.0, 6.0},
    {"bursts of 20, 5 % clean", 0.05, 400.0, 0.0, 0.0, 20.0},
    {"waits to 400 ns, 2 % clean", 0.02, 400.0, 0.0, 0.0, 1.0},
    {"waits to 400 ns, 1 % clean", 0.01, 400.0, 0.0, 2.0, 1.0},
    {"waits of 500 ns, 30 % clean", 0.3, 0.0, 500.0, 8.0, 1.0},
    {"waits of 500 ns, 30 %, runs", 0.3, 0.0, 500.0, 8.0, 4.0},
    {"waits of 20 us, 20 % clean", 0.2, 0.0, 20e3, 20.0, 1.0},
    {"waits of 5 us, 5 % clean", 0.05, 0.0, 5e3, 20.0, 1.0},
    {"waits of 5 us, 1 % clean", 0.01, 0.0, 5e3, 20.0, 1.0},
};

Outcome over_seeds(const Law& law, Duration interval) {
  Outcome all;
  all.locked = true;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Outcome one = World(law, interval, seed).run(2000);
    all.locked = all.locked && one.locked;
    all.lost += one.lost;
    all.holdovers += one.holdovers;
    all.rejected += one.rejected;
    all.messages += one.messages;
    all.worst_ns = std::max(all.worst_ns, one.worst_ns);
  }
  return all;
}

// Before lateness was told from outliers the locks were lost 413, 291, 268, 26, 0, 365, 433, 386,
// 48 and 0 times in five runs of these laws at 62.5 ms, and half of the messages refused.
TEST(LateMessages, do_not_cost_the_lock_while_the_clock_is_right) {
  for (const Law& law : kLaws) {
    for (const Nanoseconds interval : {62'500us, 125'000us, 1'000'000us}) {
      const Outcome all = over_seeds(law, Duration{interval});
      EXPECT_EQ(all.lost, 0) << law.name;
      EXPECT_EQ(all.holdovers, 0U) << law.name;
      EXPECT_TRUE(all.locked) << law.name;
      EXPECT_LT(all.worst_ns, 10e3) << law.name;
    }
  }
}

TEST(LateMessages, that_waited_are_used_and_not_rejected) {
  for (const Law& law : kLaws) {
    if (law.run > 1.0) continue;  // what stays away for long is a path that has changed
    const Outcome all = over_seeds(law, Duration{125'000us});
    EXPECT_LT(all.rejected, all.messages / 200) << law.name;
  }
}

}  // namespace
}  // namespace ftcs
