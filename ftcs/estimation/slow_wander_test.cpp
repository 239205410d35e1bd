// SPDX-License-Identifier: MIT
// World: an oscillator whose wander is about as slow as what the messages so far can tell from none
// at all; normal noise, two messages a cycle. Oracle: the truth. What is stated must hold there
// too: a filter that bets on a calm oscillator is off by more than it says.
#include <cmath>
#include <cstdio>
#include <random>

#include <gtest/gtest.h>

#include "test/support/stated_deviation.h"

namespace ftcs::estimation {
namespace {

using test::StatedDeviation;

constexpr double kNoise = 100.0;
constexpr int kSeeds = 24;

struct World {
  double white_fm;        ///< a, per cycle
  double random_walk_fm;  ///< b, per cycle
  int from, to;           ///< messages that count
};

/// Free-running oscillator: x by white FM and by the exact integral of a rate that walks.
class Oscillator {
 public:
  Oscillator(const World& world, std::uint64_t seed) : world_(world), random_(seed) {}
  double elapse(double t) {
    const double walk = kNoise * std::sqrt(world_.random_walk_fm * t);
    const double u = gaussian();
    x_ += y_ * t + walk * t * (u / 2.0 + gaussian() / std::sqrt(12.0)) +
          kNoise * std::sqrt(world_.white_fm * t) * gaussian();
    y_ += walk * u;
    return x_;
  }
  double gaussian() { return normal_(random_); }

 private:
  World world_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double x_ = 0.0;
  double y_ = 20'000.0;
};

StatedDeviation after(const World& world) {
  StatedDeviation stated;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    Oscillator oscillator(world, static_cast<std::uint64_t>(seed));
    stated.begin();
    for (int i = 0; i < world.to; ++i) {
      const double x = oscillator.elapse(0.5);
      stated.hear(i, x, 10'000.0 + kNoise * oscillator.gaussian());
      if (i >= world.from) stated.count(x);
    }
  }
  return stated;
}

TEST(SlowWander, what_is_stated_holds_where_the_wander_is_too_slow_to_be_seen) {
  for (const World& world : {World{0.0, 1e-8, 800, 2000}, World{0.0, 1e-7, 200, 1600},
                             World{0.0, 1e-6, 200, 800}, World{1e-4, 0.0, 800, 4000}}) {
    const StatedDeviation stated = after(world);
    std::printf("a %g, b %g, ", world.white_fm, world.random_walk_fm);
    stated.print("inside");
    EXPECT_GT(stated.within(1), 0.64) << world.white_fm << ' ' << world.random_walk_fm;
    EXPECT_GT(stated.within(3), 0.99) << world.white_fm << ' ' << world.random_walk_fm;
  }
}

// The price: no wander at all looks just the same.
TEST(SlowWander, of_a_calm_oscillator_it_is_wide_but_not_by_half) {
  EXPECT_LT(after({0.0, 0.0, 800, 2000}).within(1), 0.92);
}

}  // namespace
}  // namespace ftcs::estimation
