// SPDX-License-Identifier: MIT
// The world: a reference clock with a crystal up to 200 ppm off and ticks of 10 ns, plant time read
// with 100 ns of white noise, a cycle of 1 ms; the offset register takes effect with the next
// cycle.
#include "ftcs/discipline/bus_clock.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/work_unit.h"

namespace ftcs {
namespace {

class Bus : public ::testing::Test {
 protected:
  void run(int cycles, bool plant = true) {
    for (int i = 0; i < cycles; ++i) {
      true_ns_ += 1e6;
      crystal_ns_ += 1e6 * (1.0 + ppm_ * 1e-6);
      const double noise = noise_(random_) * 100.0;
      const auto ticks = static_cast<std::int64_t>(crystal_ns_ / 10.0) * 10;
      BusClockSample sample;
      sample.has_dc = !lost_(i);
      sample.usable = plant && sample.has_dc && (i % plant_each_ == plant_each_ / 3);
      sample.offset_ns = register_;
      sample.dc = LocalTime::from_ns(ticks + register_);
      sample.plant = ReferenceTime{Duration::from_ns(true_ns_ + step_ns_ + noise)};
      largest_increment_ = std::max(largest_increment_, std::abs(decided_ - register_));
      register_ = decided_;  // the frame that latched writes what was decided before it
      const BusClockDecision& decision = clock_.update(sample);
      decided_ = decision.offset_ns;
      largest_slope_ = std::max(largest_slope_, std::abs(decision.rate_ppb - last_rate_) * 1000.0);
      last_rate_ = decision.rate_ppb;
      worst_ = std::max(worst_, std::abs(error_ns()));
    }
  }
  /// True, at the SYNC0 half a cycle behind the last frame.
  [[nodiscard]] double error_ns() const {
    const double later = 0.5e6 * ppm_ * 1e-6;
    return crystal_ns_ + later + static_cast<double>(register_) - true_ns_ - step_ns_;
  }

  BusClock clock_{BusClockConfig{}};
  int plant_each_ = 1;  ///< plant time is known in one cycle of so many
  std::function<bool(int)> lost_ = [](int) { return false; };
  double ppm_ = 100.0;
  double true_ns_ = 0.0;
  double crystal_ns_ = 200'000.0;  ///< that much ahead at the start
  double step_ns_ = 0.0;
  double worst_ = 0.0;
  double last_rate_ = 0.0;
  double largest_slope_ = 0.0;
  std::int64_t largest_increment_ = 0;
  std::int64_t register_ = 0;
  std::int64_t decided_ = 0;
  std::mt19937_64 random_{7};
  std::normal_distribution<double> noise_;
};

TEST_F(Bus, follows_plant_time_from_200_us_and_100_ppm_within_twenty_seconds) {
  run(20'000);
  EXPECT_EQ(clock_.decision().state, BusClockState::kLocked);
  worst_ = 0.0;
  run(20'000);
  EXPECT_LT(worst_, 60.0);
}

TEST_F(Bus, never_jumps_and_keeps_limit_and_slope) {
  run(20'000);
  step_ns_ = 1e9;  // the grandmaster jumps by a second
  run(20'000);
  // 400 ppm of a millisecond, and the rounding of the register.
  EXPECT_LE(largest_increment_, 401);
  EXPECT_LE(largest_slope_, 1e5 * 1.000001);
  EXPECT_NE(clock_.decision().state, BusClockState::kLocked);
  EXPECT_NEAR(clock_.decision().dc_to_plant.ns(), error_ns(), 1e6);
}

TEST_F(Bus, a_step_of_20_us_is_taken_out_without_overshoot) {
  run(20'000);
  step_ns_ = 20'000.0;
  double lowest = 0.0;
  double highest = -1e9;
  for (int i = 0; i < 15'000; ++i) {
    run(1);
    lowest = std::min(lowest, error_ns());
    if (i > 1000) highest = std::max(highest, error_ns());
  }
  EXPECT_LT(std::abs(error_ns()), 60.0);
  EXPECT_LT(highest, 500.0);
  EXPECT_GE(lowest, -20'100.0);
}

TEST_F(Bus, tells_the_offset_and_how_far_it_can_be_trusted) {
  run(20'000);
  EXPECT_TRUE(clock_.decision().known);
  EXPECT_NEAR(clock_.decision().dc_to_plant.ns(), error_ns(), 60.0);
  EXPECT_GT(clock_.decision().sigma_ns, 1.0);
  EXPECT_LT(clock_.decision().sigma_ns, 100.0);
}

TEST_F(Bus, without_plant_time_the_last_rate_is_kept_and_the_deviation_grows) {
  run(20'000);
  const double before = clock_.decision().sigma_ns;
  run(60'000, false);
  EXPECT_EQ(clock_.decision().state, BusClockState::kHoldover);
  EXPECT_GT(clock_.decision().sigma_ns, 3.0 * before);
  EXPECT_LT(std::abs(error_ns()), 3000.0) << "a minute at the rate that was known";
  largest_increment_ = 0;
  run(20'000);
  EXPECT_EQ(clock_.decision().state, BusClockState::kLocked);
  EXPECT_LE(largest_increment_, 401);
}

TEST_F(Bus, tells_the_offset_of_now_however_rarely_plant_time_is_read) {
  plant_each_ = 125;
  run(30'000);
  EXPECT_EQ(clock_.decision().state, BusClockState::kLocked);
  EXPECT_NEAR(clock_.decision().dc_to_plant.ns(), error_ns(), 200.0);
  EXPECT_LT(std::abs(error_ns()), 250.0);
}

TEST_F(Bus, frames_lost_at_the_end_of_an_interval_cost_no_drift) {
  ppm_ = 200.0;
  lost_ = [](int i) { return i % 125 >= 85; };
  run(20'000);
  EXPECT_EQ(clock_.decision().state, BusClockState::kLocked);
  EXPECT_NEAR(clock_.decision().dc_to_plant.ns(), error_ns(), 60.0);
}

TEST_F(Bus, costs_a_cycle_less_than_190_divisions_and_no_heap) {
  run(2'000);
  BusClockSample sample;
  sample.usable = sample.has_dc = true;
  constexpr int kCycles = 5'000;
  const test::WorkUnits cost = test::measure_work(40, kCycles, [&] {
    const test::ForbidAllocation guard;
    for (int i = 0; i < kCycles; ++i) {
      true_ns_ += 1e6;
      sample.dc = LocalTime{Duration::from_ns(true_ns_ * (1.0 + 1e-4))};
      sample.plant = ReferenceTime{Duration::from_ns(true_ns_)};
      sample.offset_ns = clock_.update(sample).offset_ns;
    }
  });
  RecordProperty("ns_a_cycle", static_cast<int>(cost.ns));
  RecordProperty("divisions_a_cycle", static_cast<int>(cost.divisions));
  if (!test::kInstrumented) {
    EXPECT_LT(cost.divisions, 190.0);
  }
}

TEST(BusClockConfig, says_what_is_wrong_with_it) {
  using Error = BusConfigError;
  EXPECT_EQ(validate(BusClockConfig{}), std::nullopt);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto wrong = [](const auto& change) {
    BusClockConfig config;
    change(config);
    return validate(config);
  };
  EXPECT_EQ(wrong([](auto& c) { c.cycle = Nanoseconds{0}; }), Error::kCycle);
  EXPECT_EQ(wrong([](auto& c) { c.sync0_phase = -0.1; }), Error::kSync0Phase);
  EXPECT_EQ(wrong([=](auto& c) { c.sync0_phase = nan; }), Error::kSync0Phase);
  EXPECT_EQ(wrong([](auto& c) { c.cycle = c.sample_interval + Nanoseconds{1}; }),
            Error::kSampleInterval);
  EXPECT_EQ(wrong([](auto& c) { c.time_constant = Nanoseconds{0}; }), Error::kTimeConstant);
  EXPECT_EQ(wrong([](auto& c) { c.limits.slowest = Rate::from_ratio(0.0); }), Error::kRateLimits);
  EXPECT_EQ(wrong([](auto& c) { c.largest_pull_ppb = 0.0; }), Error::kPull);
  EXPECT_EQ(wrong([=](auto& c) { c.largest_slope_ppb_per_s = nan; }), Error::kSlope);
  EXPECT_EQ(wrong([](auto& c) { c.missed_intervals_to_holdover = 0; }), Error::kHoldover);
  EXPECT_EQ(wrong([](auto& c) { c.lock.band.enter = Nanoseconds{-1}; }), Error::kLock);
}

TEST_F(Bus, that_is_only_watched_is_never_moved) {
  BusClockConfig config;
  config.steer = false;
  clock_ = BusClock(config);
  run(20'000);
  EXPECT_EQ(register_, 0);
  EXPECT_TRUE(clock_.decision().known);
  EXPECT_NEAR(clock_.decision().dc_to_plant.ns(), error_ns(), 100.0);
}

TEST_F(Bus, without_any_plant_time_nothing_is_known_and_nothing_moves) {
  run(5000, false);
  EXPECT_EQ(clock_.decision().state, BusClockState::kWaiting);
  EXPECT_FALSE(clock_.decision().known);
  EXPECT_EQ(register_, 0);
}

}  // namespace
}  // namespace ftcs
