// SPDX-License-Identifier: MIT
// World: a rate that walks, and a port that is saturated for half of the time, or where nearly all
// messages wait, some for next to nothing; a rate that steps; waits without a floor. Two messages a
// cycle, normal noise. Oracle: the truth. The stated deviation must hold while and after next to
// nothing has been at the floor, and before a step is believed; and it must not flare at a wait.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include <gtest/gtest.h>

#include "test/support/stated_deviation.h"

namespace ftcs::estimation {
namespace {

using test::StatedDeviation;

constexpr double kDelay = 10'000.0;

/// The rate walks, and messages wait.
struct Loaded {
  double walk;   ///< ns per cycle and root cycle
  double wait;   ///< ns, the mean
  double calm;   ///< share that waits
  double busy;   ///< the same, while the port is busy
  int idle_for;  ///< messages of each round, before it is
  int round;     ///< messages
  int from;      ///< that count
  int to;
};

StatedDeviation loaded(const Loaded& world) {
  constexpr double kNoise = 20.0;
  StatedDeviation stated;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::exponential_distribution<double> wait(1.0 / world.wait);
    std::uniform_real_distribution<double> even;
    stated.begin();
    double x = 0.0;
    double y = 6'250.0;
    for (int i = 0; i < world.to; ++i) {
      x += 0.5 * y;
      y += world.walk * std::sqrt(0.5) * normal(random);
      const double waiting = i % world.round < world.idle_for ? world.calm : world.busy;
      const double queued = even(random) < waiting ? wait(random) : 0.0;
      stated.hear(i, x, kDelay + queued + kNoise * normal(random));
      if (i >= world.from) stated.count(x);
    }
  }
  return stated;
}

/// +-1 ppm at 125 ms, every fifty cycles.
StatedDeviation steps() {
  constexpr double kNoise = 100.0;
  StatedDeviation stated;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    stated.begin();
    const int phase = static_cast<int>(random() % 100);
    double x = 0.0;
    double y = 0.0;
    for (int i = 0; i < 4800; ++i) {
      x += 0.5 * y;
      y = 6'250.0 + ((i + phase) / 100 % 2 == 0 ? 125.0 : -125.0);
      stated.hear(i, x, kDelay + kNoise * normal(random));
      if (i >= 1200) stated.count(x);
    }
  }
  return stated;
}

TEST(Deviation, holds_through_saturation_and_after_it) {
  const StatedDeviation stated = loaded({0.01, 400'000.0, 0.3, 0.99, 480, 960, 1920, 7680});
  stated.print("saturation");
  EXPECT_GT(stated.within(3), 0.985);
  EXPECT_LT(stated.within(1), 0.76);
}

TEST(Deviation, holds_where_a_message_just_late_may_have_waited) {
  const StatedDeviation stated = loaded({0.1, 10'000.0, 0.97, 0.97, 1, 1, 2400, 7200});
  stated.print("just late");
  EXPECT_GT(stated.within(3), 0.995);
  EXPECT_LT(stated.within(1), 0.95);
}

/// 100 ns in the mean.
TEST(Deviation, does_not_flare_where_a_message_waits_as_others_do) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::exponential_distribution<double> wait(0.01);
  StatedDeviation stated;
  double x = 0.0;
  double largest = 0.0;
  for (int i = 0; i < 9600; ++i) {
    x += 0.5 * 6'250.0;
    stated.hear(i, x, kDelay + wait(random) + normal(random));
    if (i >= 4800) largest = std::max(largest, stated.sigma());
  }
  std::printf("waits: %.1f ns at most\n", largest);
  EXPECT_LT(largest, 30.0);
}

TEST(Deviation, holds_before_a_step_of_the_rate_is_believed) {
  const StatedDeviation stated = steps();
  stated.print("steps");
  EXPECT_GT(stated.within(3), 0.99);
  EXPECT_LT(stated.within(1), 0.85);
}

}  // namespace
}  // namespace ftcs::estimation
