// SPDX-License-Identifier: MIT
// World: a perfect oscillator, an affine reference, exact stamps. The expected gains were worked
// out by hand from the formulas of ptp4l(8): kp = min(scale T^exponent, norm_max / T), ki likewise.
#include "ftcs/servo/linuxptp_pi_servo.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "test/support/affine_plant.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::AffinePlant;

LinuxptpPiConfig hardware(Nanoseconds interval) {
  LinuxptpPiConfig config;
  config.sync_interval = interval;
  return config;
}

LinuxptpPiConfig software(Nanoseconds interval) {
  LinuxptpPiConfig config = hardware(interval);
  config.timestamping = TimestampingKind::kSoftware;
  return config;
}

/// One sample a second, ahead of the reference by `offset_ns`.
SyncSample sample_at(double second, std::int64_t offset_ns) {
  const auto now = static_cast<std::int64_t>(second * 1e9);
  return {ReferenceTime::from_ns(now), Duration{}, LocalTime::from_ns(now + offset_ns),
          FreeRunningTime::from_ns(now)};
}

struct GainCase {
  double interval_s;
  double proportional;
  double integral;
};

TEST(LinuxptpPiGains, for_hardware_stamps) {
  const GainCase cases[] = {
      {1.0, 0.7, 0.3},
      {0.5, 0.861801, 0.227357},       // 0.7 * 2^0.3, 0.3 * 2^-0.4
      {0.125, 1.306246, 0.130583},     // 0.7 * 8^0.3, 0.3 * 8^-0.4
      {0.015625, 2.437542, 0.056839},  // 0.7 * 64^0.3, 0.3 * 64^-0.4
      {2.0, 0.35, 0.15},               // both capped: 0.7 / 2, 0.3 / 2
      {16.0, 0.04375, 0.01875},
  };
  for (const GainCase& expected : cases) {
    const PiGains gains = linuxptp_gains(LinuxptpPiConfig{}, expected.interval_s);
    EXPECT_NEAR(gains.proportional, expected.proportional, 1e-6) << expected.interval_s;
    EXPECT_NEAR(gains.integral, expected.integral, 1e-6) << expected.interval_s;
  }
}

TEST(LinuxptpPiGains, for_software_stamps) {
  const GainCase cases[] = {
      {1.0, 0.1, 0.001},
      {0.125, 0.186607, 0.000435275},  // 0.1 * 8^0.3, 0.001 * 8^-0.4
      {2.0, 0.0812252, 0.00131951},    // not capped
      {16.0, 0.0435275, 0.00303143},   // 0.7 / 16 is just above
      {32.0, 0.021875, 0.0040},        // kp capped: 0.7 / 32; ki = 0.001 * 32^0.4 = 0.001 * 4
  };
  for (const GainCase& expected : cases) {
    const PiGains gains = linuxptp_gains(software(1s), expected.interval_s);
    EXPECT_NEAR(gains.proportional, expected.proportional, 1e-6) << expected.interval_s;
    EXPECT_NEAR(gains.integral, expected.integral, 1e-8) << expected.interval_s;
  }
}

TEST(LinuxptpPiGains, may_be_given_as_constants_or_scales) {
  LinuxptpPiConfig config;
  config.proportional_const = 0.5;
  config.integral_const = 0.25;
  EXPECT_EQ(linuxptp_gains(config, 0.125).proportional, 0.5);
  EXPECT_EQ(linuxptp_gains(config, 0.125).integral, 0.25);
  EXPECT_EQ(linuxptp_gains(config, 4.0).proportional, 0.25);  // 1 / T
  EXPECT_EQ(linuxptp_gains(config, 16.0).integral, 0.125);    // 2 / T
  LinuxptpPiConfig scaled;
  scaled.proportional_scale = 0.4;
  scaled.integral_scale = 0.2;
  scaled.proportional_exponent = -1.0;
  scaled.integral_exponent = 1.0;
  scaled.proportional_norm_max = 0.5;
  scaled.integral_norm_max = 10.0;
  EXPECT_NEAR(linuxptp_gains(scaled, 2.0).proportional, 0.2, 1e-15);
  EXPECT_NEAR(linuxptp_gains(scaled, 2.0).integral, 0.4, 1e-15);
}

TEST(LinuxptpPiServo, takes_the_first_frequency_from_two_samples_and_steps) {
  AffinePlant plant{1.0L / (1.0L + 50e-6L), 1ms};
  LinuxptpPiServo servo{hardware(1s)};
  EXPECT_FALSE(servo.update(plant.sample(), plant.read()).has_command);
  EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
  plant.advance_reference(Nanoseconds{1s});
  const ServoUpdate update = servo.update(plant.sample(), plant.read());
  ASSERT_TRUE(update.has_command);
  EXPECT_EQ(servo.snapshot().state, ServoState::kJump);
  EXPECT_NEAR(update.command.step.ns(), -1'050'000.0, 1e-3);
  plant.apply(update.command);
  plant.advance_reference(Nanoseconds{1s});
  EXPECT_NEAR(plant.offset_ns(), 0.0, 1e-3);
  EXPECT_TRUE(servo.update(plant.sample(), plant.read()).has_command);
  EXPECT_EQ(servo.snapshot().state, ServoState::kLocked);
}

TEST(LinuxptpPiServo, steps_only_above_the_first_threshold_and_only_once) {
  const auto first_lock = [](LinuxptpPiServo& servo, std::int64_t offset_ns, double start_s) {
    (void)servo.update(sample_at(start_s, offset_ns), {});
    return servo.update(sample_at(start_s + 1, offset_ns), {}).command.step;
  };
  LinuxptpPiServo at_threshold{hardware(1s)};
  EXPECT_EQ(first_lock(at_threshold, 20'000, 0), Duration{});
  EXPECT_EQ(at_threshold.snapshot().state, ServoState::kLocked);
  LinuxptpPiServo above{hardware(1s)};
  EXPECT_EQ(first_lock(above, -20'001, 0), Duration{Nanoseconds{20'001}});
  above.reset();
  EXPECT_EQ(first_lock(above, -20'001, 10), Duration{});
  LinuxptpPiConfig config = hardware(1s);
  config.first_step_threshold = 0ns;
  LinuxptpPiServo never{config};
  EXPECT_EQ(first_lock(never, 1'000'000'000, 0), Duration{});
}

TEST(LinuxptpPiServo, starts_again_and_steps_beyond_the_step_threshold) {
  LinuxptpPiConfig config = hardware(1s);
  config.step_threshold = 1ms;
  config.first_step_threshold = 0ns;
  LinuxptpPiServo at_threshold{config};
  (void)at_threshold.update(sample_at(0, 1'000'000), {});
  EXPECT_EQ(at_threshold.update(sample_at(1, 1'000'000), {}).command.step, Duration{});
  LinuxptpPiServo servo{config};
  (void)servo.update(sample_at(0, 0), {});
  EXPECT_TRUE(servo.update(sample_at(1, 0), {}).has_command);
  EXPECT_TRUE(servo.update(sample_at(2, 1'000'000), {}).has_command);
  EXPECT_FALSE(servo.update(sample_at(3, 1'000'001), {}).has_command);
  EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
  EXPECT_FALSE(servo.update(sample_at(4, 2'000'000), {}).has_command);
  EXPECT_EQ(servo.update(sample_at(5, 2'000'000), {}).command.step, Duration{Nanoseconds{-2ms}});
  EXPECT_EQ(servo.snapshot().state, ServoState::kJump);
}

TEST(LinuxptpPiServo, runs_the_positional_pi) {
  LinuxptpPiServo servo{hardware(1s)};
  (void)servo.update(sample_at(0, 0), {});
  const SyncSample skewed = {ReferenceTime::from_ns(1'000'000'000), Duration{},
                             LocalTime::from_ns(1'000'000'000),
                             FreeRunningTime::from_ns(1'000'010'000)};
  const ServoUpdate first = servo.update(skewed, {});
  const double drift =
      -(1.0 / 1.00001 - 1.0) * 1e9;  // how fast the oscillator is, in its own units
  EXPECT_NEAR(first.command.tracking_rate.ppb(), -drift, 1e-3);
  const double second = servo.update(sample_at(2, 1'000), {}).command.tracking_rate.ppb();
  EXPECT_NEAR(second, -(0.7 * 1'000 + drift + 0.3 * 1'000), 1e-3);
  const double third = servo.update(sample_at(3, -500), {}).command.tracking_rate.ppb();
  EXPECT_NEAR(third, -(0.7 * -500 + drift + 300.0 + 0.3 * -500), 1e-3);
  EXPECT_NEAR(servo.snapshot().rate_ratio.ppb(), -(drift + 300.0 - 150.0), 1e-3);
}

TEST(LinuxptpPiServo, waits_for_a_baseline_that_the_integral_gain_demands) {
  // Software stamps, T = 1 s: 0.016 / 0.001 = 16 s.
  LinuxptpPiServo servo{software(1s)};
  for (int n = 0; n < 16; ++n) {
    EXPECT_FALSE(servo.update(sample_at(n, 0), {}).has_command) << n;
  }
  EXPECT_TRUE(servo.update(sample_at(16, 0), {}).has_command);
  LinuxptpPiConfig config = hardware(1s);
  config.integral_const = 1e-6;  // 16,000 s, limited to 1,000 s
  LinuxptpPiServo slow{config};
  (void)slow.update(sample_at(0, 0), {});
  EXPECT_FALSE(slow.update(sample_at(999, 0), {}).has_command);
  EXPECT_TRUE(slow.update(sample_at(1000, 0), {}).has_command);
}

TEST(LinuxptpPiServo, freezes_the_integrator_while_the_frequency_is_limited) {
  LinuxptpPiConfig config = hardware(1s);
  config.first_step_threshold = 0ns;
  config.max_frequency_ppb = 100'000.0;
  LinuxptpPiServo servo{config};
  (void)servo.update(sample_at(0, 1'000'000), {});
  (void)servo.update(sample_at(1, 1'000'000), {});
  for (int n = 2; n < 10; ++n) {
    const ServoUpdate update = servo.update(sample_at(n, 1'000'000), {});
    EXPECT_NEAR(update.command.tracking_rate.ppb(), -100'000.0, 1e-3);
  }
  EXPECT_NEAR(servo.update(sample_at(10, 0), {}).command.tracking_rate.ppb(), 0.0, 1e-3);
}

TEST(LinuxptpPiServo, the_narrower_of_limits_and_max_frequency_holds) {
  LinuxptpPiConfig config = hardware(1s);
  config.first_step_threshold = 0ns;
  config.limits = RateLimits::symmetric_ppb(50'000.0);
  config.max_frequency_ppb = 100'000.0;
  LinuxptpPiServo servo{config};
  (void)servo.update(sample_at(0, -1'000'000), {});
  (void)servo.update(sample_at(1, -1'000'000), {});
  EXPECT_NEAR(servo.update(sample_at(2, -1'000'000), {}).command.tracking_rate.ppb(), 50'000.0,
              1e-3);
}

TEST(LinuxptpPiServo, measures_the_interval_at_the_start_when_none_is_configured) {
  LinuxptpPiServo servo{};
  EXPECT_EQ(servo.gains().proportional, 0.0);  // not known yet
  (void)servo.update(sample_at(0, 0), {});
  (void)servo.update(sample_at(0.125, 0), {});
  EXPECT_NEAR(servo.gains().proportional, 1.306246, 1e-6);
  (void)servo.update(sample_at(1, 0), {});
  EXPECT_NEAR(servo.gains().proportional, 1.306246, 1e-6);
}

TEST(LinuxptpPiServo, keeps_to_the_configured_interval_whatever_the_samples_say) {
  LinuxptpPiServo servo{hardware(1s)};
  (void)servo.update(sample_at(0, 0), {});
  (void)servo.update(sample_at(0.125, 0), {});
  EXPECT_NEAR(servo.gains().proportional, 0.7, 1e-12);
}

TEST(LinuxptpPiServo, ignores_repetitions_and_survives_a_reference_that_goes_backward) {
  LinuxptpPiServo servo{hardware(1s)};
  (void)servo.update(sample_at(5, 0), {});
  const ServoUpdate repeated = servo.update(sample_at(5, 0), {});
  EXPECT_EQ(repeated.verdict, SampleVerdict::kDuplicate);
  EXPECT_FALSE(repeated.has_command);
  SyncSample still = sample_at(5.5, 0);
  still.origin = ReferenceTime::from_ns(5'000'000'000);
  EXPECT_EQ(servo.update(still, {}).verdict, SampleVerdict::kImplausible);
  SyncSample back = sample_at(6, 0);
  back.origin = ReferenceTime::from_ns(1'000'000'000);
  const ServoUpdate backward = servo.update(back, {});
  EXPECT_EQ(backward.verdict, SampleVerdict::kImplausible);
  EXPECT_FALSE(backward.has_command);
  SyncSample next = sample_at(7, 0);
  next.origin = ReferenceTime::from_ns(2'000'000'000);
  EXPECT_TRUE(servo.update(next, {}).has_command);
  EXPECT_EQ(servo.update(sample_at(6.5, 0), {}).verdict, SampleVerdict::kDuplicate);
}

TEST(LinuxptpPiServo, what_is_not_used_commands_nothing) {
  LinuxptpPiServo servo{hardware(1s)};
  (void)servo.update(sample_at(5, 0), {});
  EXPECT_FALSE(servo.update(sample_at(5, 0), {}).has_command);
  SyncSample standing = sample_at(6, 0);
  standing.origin = ReferenceTime::from_ns(5'000'000'000);
  const ServoUpdate update = servo.update(standing, {});  // the reference stands still
  EXPECT_EQ(update.verdict, SampleVerdict::kImplausible);
  EXPECT_FALSE(update.has_command);
}

TEST(LinuxptpPiServo, a_configured_interval_is_not_measured) {
  LinuxptpPiServo servo{hardware(1s)};
  (void)servo.update(sample_at(0, 0), {});
  (void)servo.update(sample_at(0.125, 0), {});
  EXPECT_EQ(servo.gains().proportional, 0.7);
  EXPECT_EQ(LinuxptpPiServo{}.gains().proportional, 0.0);  // not known yet
  EXPECT_EQ(LinuxptpPiServo{}.gains().integral, 0.0);
}

TEST(LinuxptpPiServo, steps_at_the_start_only_beyond_the_step_threshold) {
  LinuxptpPiConfig config = hardware(1s);
  config.first_step_threshold = 0ns;
  config.step_threshold = 1ms;
  EXPECT_EQ(validate(config), std::nullopt);
  for (const std::int64_t sign : {1, -1}) {
    LinuxptpPiServo at_threshold{config};
    (void)at_threshold.update(sample_at(0, sign * 1'000'000), {});
    EXPECT_EQ(at_threshold.update(sample_at(1, sign * 1'000'000), {}).command.step, Duration{});
    LinuxptpPiServo beyond{config};
    (void)beyond.update(sample_at(0, sign * 1'000'001), {});
    EXPECT_EQ(beyond.update(sample_at(1, sign * 1'000'001), {}).command.step,
              Duration{Nanoseconds{-sign * 1'000'001}});
  }
}

TEST(LinuxptpPiServo, allocates_nothing) {
  const test::ForbidAllocation guard;
  LinuxptpPiServo servo{};
  for (int n = 0; n < 10; ++n) (void)servo.update(sample_at(n, n), {});
  servo.reset();
}

TEST(LinuxptpPiConfig, names_what_is_wrong) {
  const auto error_of = [](auto change) {
    LinuxptpPiConfig config;
    change(config);
    return validate(config);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  using Config = LinuxptpPiConfig;
  EXPECT_EQ(error_of([](Config&) {}), std::nullopt);
  EXPECT_EQ(error_of([](Config& c) { c.sync_interval = -1ns; }), ServoConfigError::kSyncInterval);
  for (double Config::*gain :
       {&Config::proportional_const, &Config::proportional_scale, &Config::proportional_norm_max}) {
    EXPECT_EQ(error_of([gain](Config& c) { c.*gain = -0.1; }), ServoConfigError::kProportionalGain);
  }
  for (double Config::*gain :
       {&Config::integral_const, &Config::integral_scale, &Config::integral_norm_max}) {
    EXPECT_EQ(error_of([gain](Config& c) { c.*gain = kNan; }), ServoConfigError::kIntegralGain);
  }
  EXPECT_EQ(error_of([](Config& c) { c.proportional_exponent = kNan; }),
            ServoConfigError::kProportionalGain);
  EXPECT_EQ(error_of([](Config& c) { c.integral_exponent = kNan; }),
            ServoConfigError::kIntegralGain);
  EXPECT_EQ(error_of([](Config& c) { c.first_step_threshold = 0ns; }), std::nullopt);
  EXPECT_EQ(error_of([](Config& c) { c.first_step_threshold = -1ns; }),
            ServoConfigError::kStepThreshold);
  EXPECT_EQ(error_of([](Config& c) { c.step_threshold = -1ns; }), ServoConfigError::kStepThreshold);
  EXPECT_EQ(error_of([](Config& c) { c.max_frequency_ppb = 1e9; }), ServoConfigError::kRateLimits);
  EXPECT_EQ(error_of([](Config& c) { c.limits.slowest = Rate::from_ratio(-1.0); }),
            ServoConfigError::kRateLimits);
}

}  // namespace
}  // namespace ftcs
