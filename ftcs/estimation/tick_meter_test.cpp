// SPDX-License-Identifier: MIT
// World: differences of timestamps that are multiples of a clock's step.
#include "ftcs/estimation/tick_meter.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

TEST(TickMeter, finds_the_step_of_a_coarse_clock) {
  TickMeter meter;
  EXPECT_EQ(meter.variance_ns2(), 0.0);
  for (const std::uint64_t ticks : {125'000'013U, 124'999'987U, 125'000'006U}) {
    meter.observe(ticks * 8);
  }
  EXPECT_DOUBLE_EQ(meter.variance_ns2(), 64.0 / 12.0);
  EXPECT_DOUBLE_EQ(meter.rounding_ns2(), 64.0 / 12.0);
}

TEST(TickMeter, takes_nanoseconds_for_exact_for_good) {
  TickMeter meter;
  meter.observe(1'000'000'007);
  meter.observe(1'000'000'010);
  for (int i = 0; i < 10; ++i) meter.observe(8'000);
  EXPECT_EQ(meter.variance_ns2(), 0.0);
  EXPECT_DOUBLE_EQ(meter.rounding_ns2(), 1.0 / 12.0) << "but noise of less than that is luck";
}

TEST(TickMeter, a_schedule_is_no_step) {
  TickMeter meter;
  for (int i = 0; i < 10; ++i) meter.observe(1'000'000'000);
  EXPECT_EQ(meter.variance_ns2(), 0.0);
}

TEST(TickMeter, repetitions_and_long_gaps_tell_nothing) {
  TickMeter meter;
  meter.observe(10'000);
  meter.observe(0);
  meter.observe(std::uint64_t{1} << 40U);
  EXPECT_DOUBLE_EQ(meter.variance_ns2(), 1e8 / 12.0);
}

TEST(TickMeter, noise_lets_averaging_see_what_rounding_hides) {
  TickMeter meter;
  meter.observe(800);
  meter.observe(808);
  EXPECT_DOUBLE_EQ(meter.variance_ns2(), 64.0 / 12.0);
  EXPECT_DOUBLE_EQ(meter.hidden_ns2(0.0), 64.0 / 12.0);
  // A third of a step: exp(-4 pi^2 / 9).
  EXPECT_NEAR(meter.hidden_ns2(64.0 / 9.0), 64.0 / 12.0 * 0.01245, 1e-4);
  EXPECT_LT(meter.hidden_ns2(100.0), 1e-20);
}

// Oracle: the mean of many rounded readings, at phases all over a step.
TEST(TickMeter, what_is_hidden_is_what_a_long_mean_is_wrong_by) {
  constexpr double kStep = 8.0;
  TickMeter meter;
  meter.observe(800);
  meter.observe(808);
  for (const double noise : {0.8, 1.6, 2.4}) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal(0.0, noise);
    double squares = 0.0;
    constexpr int kPhases = 40;
    constexpr int kReadings = 20'000;
    for (int k = 0; k < kPhases; ++k) {
      const double truth = kStep * k / kPhases;
      double sum = 0.0;
      for (int i = 0; i < kReadings; ++i) {
        sum += kStep * std::round((truth + normal(random)) / kStep) - truth;
      }
      squares += sum / kReadings * (sum / kReadings);
    }
    const double wrong = std::sqrt(squares / kPhases);
    const double stated = std::sqrt(meter.hidden_ns2(noise * noise));
    EXPECT_LT(wrong, stated) << noise;
    EXPECT_GT(wrong, 0.7 * stated) << noise;
  }
}

}  // namespace
}  // namespace ftcs::estimation
