// SPDX-License-Identifier: MIT
// World: a perfect oscillator, an affine reference, exact stamps. offset = local - reference, e =
// -offset.
#include "ftcs/servo/pics_servo.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/affine_plant.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::AffinePlant;

PicsConfig with_gains(double proportional_gain, double integral_gain) {
  PicsConfig config;
  config.sync_interval = 100us;
  config.proportional_gain = proportional_gain;
  config.integral_gain = integral_gain;
  return config;
}

/// One sample every 100 us, ahead of the reference by `offset_ns`.
SyncSample sample_at(std::int64_t n, std::int64_t offset_ns) {
  return {ReferenceTime::from_ns(n * 100'000), Duration{},
          LocalTime::from_ns(n * 100'000 + offset_ns), FreeRunningTime::from_ns(n * 100'000)};
}

double rate_after(PicsServo& servo, std::int64_t n, std::int64_t offset_ns) {
  const ServoUpdate update = servo.update(sample_at(n, offset_ns), {});
  EXPECT_TRUE(update.has_command);
  EXPECT_EQ(update.command.correction_time, Duration{});
  EXPECT_EQ(update.command.correction_rate, update.command.tracking_rate);
  EXPECT_EQ(update.command.step, Duration{});
  return update.command.tracking_rate.ratio();
}

TEST(PicsServo, is_equation_26) {
  PicsServo servo{with_gains(0.5, 0.3)};
  EXPECT_NEAR(rate_after(servo, 0, -1000), 1.0 + 0.3 * 1000 / 1e5, 1e-15);  // e(-1) = e(0)
  EXPECT_NEAR(rate_after(servo, 1, -600), 1.003 + (0.5 * -400 + 0.3 * 600) / 1e5, 1e-15);
  EXPECT_NEAR(rate_after(servo, 2, 200), 1.0028 + (0.5 * -800 + 0.3 * -200) / 1e5, 1e-15);
  EXPECT_EQ(servo.snapshot().offset, Duration{Nanoseconds{200}});
  EXPECT_EQ(servo.snapshot().state, ServoState::kLocked);
}

TEST(PicsServo, previous_error_may_start_at_zero) {
  PicsConfig config = with_gains(0.5, 0.3);
  config.previous_error_starts_at_zero = true;
  PicsServo servo{config};
  EXPECT_NEAR(rate_after(servo, 0, -1000), 1.0 + (0.5 + 0.3) * 1000 / 1e5, 1e-15);
}

TEST(PicsServo, with_optimal_gains_needs_two_intervals_for_offset_and_skew) {
  AffinePlant plant{1.0L + 50e-6L, Nanoseconds{-21us}};
  PicsServo servo{with_gains(1.0, 1.0)};
  std::vector<double> offsets;
  for (int n = 0; n < 5; ++n) {
    plant.apply(servo.update(plant.sample(), plant.read()).command);
    plant.advance_reference(Nanoseconds{100us});
    offsets.push_back(std::abs(plant.offset_ns()));
  }
  EXPECT_GT(offsets[0], 4.0);  // the skew is not known yet
  EXPECT_LT(offsets[1], 2.0);  // second order: the gain is wrong by the skew
  EXPECT_LT(offsets[4], 0.01);
}

TEST(PicsServo, the_interval_is_measured_when_none_is_configured) {
  PicsConfig config = with_gains(1.0, 1.0);
  config.sync_interval = 0ns;
  PicsServo servo{config};
  EXPECT_FALSE(servo.update(sample_at(0, -1000), {}).has_command);
  EXPECT_NEAR(rate_after(servo, 2, -1000), 1.0 + 1000 / 2e5, 1e-15);
  EXPECT_NEAR(rate_after(servo, 3, -1000), 1.005 + 1000 / 1e5, 1e-15);
}

TEST(PicsServo, a_limited_rate_does_not_wind_up) {
  PicsConfig config = with_gains(0.0, 1.0);
  config.limits = RateLimits::symmetric_ppb(1e6);
  PicsServo servo{config};
  for (int n = 0; n < 100; ++n) EXPECT_EQ(rate_after(servo, n, -50'000), 1.001);
  EXPECT_NEAR(rate_after(servo, 100, 50), 1.001 - 50 / 1e5, 1e-12);  // turns round at once
  EXPECT_EQ(rate_after(servo, 101, 50'000), 0.999);
}

TEST(PicsServo, starts_at_the_rate_the_clock_has) {
  PicsConfig config = with_gains(1.0, 1.0);
  config.initial_rate = Rate::from_ppm(-74'000.0);
  PicsServo servo{config};
  EXPECT_NEAR(rate_after(servo, 0, 0), 0.926, 1e-12);
}

TEST(PicsServo, ignores_repetitions_and_starts_again_after_a_jump) {
  PicsServo servo{with_gains(1.0, 0.0)};
  EXPECT_EQ(rate_after(servo, 0, 0), 1.0);
  EXPECT_EQ(rate_after(servo, 1, 0), 1.0);
  EXPECT_FALSE(servo.update(sample_at(1, 500), {}).has_command);
  EXPECT_EQ(servo.update(sample_at(1, 500), {}).verdict, SampleVerdict::kDuplicate);
  EXPECT_FALSE(servo.update(sample_at(1, 500), {}).has_command);
  EXPECT_EQ(servo.update(sample_at(0, 500), {}).verdict, SampleVerdict::kDuplicate);
  SyncSample jump = sample_at(2, 0);
  jump.origin = jump.origin + Nanoseconds{1s};
  const ServoUpdate update = servo.update(jump, {});
  EXPECT_EQ(update.verdict, SampleVerdict::kImplausible);
  EXPECT_FALSE(update.has_command);
  EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
  SyncSample next = sample_at(3, 0);
  next.origin = next.origin + Nanoseconds{1s};
  EXPECT_EQ(servo.update(next, {}).command.tracking_rate.ratio(), 1.0);  // no proportional kick
}

TEST(PicsServo, reset_forgets_the_previous_error_and_keeps_the_rate) {
  PicsServo servo{with_gains(1.0, 1.0)};
  EXPECT_EQ(rate_after(servo, 0, -100), 1.001);
  servo.reset();
  EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
  EXPECT_NEAR(rate_after(servo, 1, 0), 1.001, 1e-15);
}

TEST(PicsServo, a_step_by_somebody_else_moves_the_previous_error_along) {
  PicsServo servo{with_gains(1.0, 0.0)};
  EXPECT_EQ(rate_after(servo, 0, 1'000), 1.0);
  servo.on_step(Nanoseconds{-1'000});
  EXPECT_EQ(rate_after(servo, 1, 0), 1.0);
}

TEST(PicsServo, allocates_nothing) {
  const test::ForbidAllocation guard;
  PicsServo servo{with_gains(1.0, 1.0)};
  for (int n = 0; n < 10; ++n) (void)servo.update(sample_at(n, n), {});
  servo.reset();
}

TEST(PicsConfig, names_what_is_wrong) {
  const auto error_of = [](auto change) {
    PicsConfig config = with_gains(1.0, 1.0);
    change(config);
    return validate(config);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(error_of([](PicsConfig&) {}), std::nullopt);
  EXPECT_EQ(error_of([](PicsConfig& c) { c.proportional_gain = 0.0; }), std::nullopt);
  EXPECT_EQ(error_of([](PicsConfig& c) { c.integral_gain = 0.0; }), std::nullopt);
  EXPECT_EQ(error_of([](PicsConfig& c) { c.sync_interval = -1ns; }),
            ServoConfigError::kSyncInterval);
  for (const double bad : {-1e-9, kNan, kInfinity}) {
    EXPECT_EQ(error_of([bad](PicsConfig& c) { c.proportional_gain = bad; }),
              ServoConfigError::kProportionalGain);
    EXPECT_EQ(error_of([bad](PicsConfig& c) { c.integral_gain = bad; }),
              ServoConfigError::kIntegralGain);
  }
  EXPECT_EQ(error_of([](PicsConfig& c) { c.limits.fastest = Rate::from_ratio(0.5); }),
            ServoConfigError::kRateLimits);
  EXPECT_EQ(error_of([](PicsConfig& c) { c.plausible_ratio.slowest = Rate::from_ratio(0.0); }),
            ServoConfigError::kPlausibleRatio);
}

}  // namespace
}  // namespace ftcs
