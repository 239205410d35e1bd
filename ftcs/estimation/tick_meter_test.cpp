// SPDX-License-Identifier: MIT
// World: differences of timestamps that are multiples of a clock's step.
#include "ftcs/estimation/tick_meter.h"

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

}  // namespace
}  // namespace ftcs::estimation
