// SPDX-License-Identifier: MIT
#include "ftcs/estimation/clock_state.h"

#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

Estimate some_state() { return {1.0, 2.0, 3.0, 5.0, 0.5, 0.25, 4.0, 0.125, 3.0}; }

TEST(ClockState, the_drift_moves_the_offset_and_its_doubt_spreads) {
  Estimate e = some_state();
  e.elapse(2.0, {});
  EXPECT_EQ(e.x, 5.0);
  EXPECT_EQ(e.xx, 5.0 + 2.0 * 2.0 * 0.5 + 4.0 * 4.0);
  EXPECT_EQ(e.xy, 0.5 + 2.0 * 4.0);
  EXPECT_EQ(e.xd, 0.25 + 2.0 * 0.125);
}

TEST(ClockState, process_noise_grows_with_time_in_either_direction) {
  const ProcessNoise<double> q{1.0, 3.0, 0.5};
  for (const double t : {2.0, -2.0}) {
    Estimate e;
    e.elapse(t, q);
    EXPECT_EQ(e.xx, 2.0 + 3.0 * 8.0 / 3.0);
    EXPECT_EQ(e.xy, 3.0 * t * 2.0 / 2.0);
    EXPECT_EQ(e.yy, 6.0);
    EXPECT_EQ(e.dd, 1.0);
  }
}

TEST(ClockState, a_message_halves_the_doubt_that_is_as_large_as_its_noise) {
  Estimate e;
  e.xx = 1.0;
  const double nu = e.innovation(1.0, 10.0);
  const double spread = e.variance_seen(1.0) + 1.0;
  e.absorb(1.0, 1.0, nu / spread, 1.0 / spread);
  EXPECT_EQ(e.x, 5.0);
  EXPECT_EQ(e.xx, 0.5);
}

TEST(ClockState, late_is_positive_in_both_directions) {
  Estimate e;
  e.d = 100.0;
  EXPECT_EQ(e.innovation(1.0, 107.0), 7.0);
  EXPECT_EQ(e.innovation(-1.0, -107.0), 7.0);
}

TEST(ClockState, each_lane_has_the_bits_that_it_would_have_alone) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Estimate alone[2] = {some_state(), some_state()};
  alone[1].xx = 50.0;
  ClockState<Pair> pair;
  for (std::size_t lane = 0; lane < 2; ++lane) pair.set_lane(lane, alone[lane]);
  const ProcessNoise<double> noise[2] = {{1e-3, 1e-5, 0.0}, {0.0, 1e-2, 1e-9}};
  const ProcessNoise<Pair> both{Pair{1e-3, 0.0}, Pair{1e-5, 1e-2}, Pair{0.0, 1e-9}};
  for (int n = 0; n < 1000; ++n) {
    const double sign = n % 2 == 0 ? 1.0 : -1.0;
    const double z = normal(random);
    pair.elapse(0.7, both);
    const Pair spread = pair.variance_seen(sign) + 1.0;
    pair.absorb(sign, 1.0, pair.innovation(sign, z) / spread, 1.0 / spread);
    for (std::size_t lane = 0; lane < 2; ++lane) {
      Estimate& e = alone[lane];
      e.elapse(0.7, noise[lane]);
      const double own = e.variance_seen(sign) + 1.0;
      e.absorb(sign, 1.0, e.innovation(sign, z) / own, 1.0 / own);
      ASSERT_EQ(pair.lane(lane).x, e.x) << n;
      ASSERT_EQ(pair.lane(lane).yd, e.yd) << n;
      ASSERT_EQ(pair.lane(lane).xx, e.xx) << n;
    }
  }
}

TEST(ClockState, a_broken_covariance_is_seen) {
  Estimate e = some_state();
  EXPECT_GT(e.health(1e-9).positive, 0.0);
  EXPECT_EQ(e.health(1e-9).finite, 0.0);
  e.xy = 100.0;
  EXPECT_LT(e.health(1e-9).positive, 0.0);
  e.x = 1.0 / 0.0;
  EXPECT_NE(e.health(1e-9).finite, 0.0);
}

}  // namespace
}  // namespace ftcs::estimation
