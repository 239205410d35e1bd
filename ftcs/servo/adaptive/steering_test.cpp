// SPDX-License-Identifier: MIT
// World: a local clock with a known offset (local - reference) and a free-running clock of known,
// constant rate r against the reference. After the command's correction time the offset must be
// gone: local moves by T_c r * correction rate while the reference moves by T_c.
#include "ftcs/servo/adaptive/steering.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ftcs::adaptive {
namespace {

double offset_after(const ServoCommand& command, const SteeringState& state) {
  // correction_time lasts correction_time / tracking_rate on the oscillator (servo_command.h).
  const double free = command.correction_time.ns() / command.tracking_rate.ratio();
  return state.offset_ns + command.step.ns() + free * command.correction_rate.ratio() -
         free / state.free_per_reference;
}

SteeringLimits wide() {
  SteeringLimits limits;
  limits.rate = RateLimits::symmetric_ppb(9e8);
  return limits;
}

TEST(Steering, removes_the_offset_exactly_even_at_thousands_of_ppm) {
  Steering steering{wide()};
  for (double offset : {1e6, -3e5, 12.0, 0.0}) {
    for (double r : {1.0, 0.99, 1.00005}) {
      const SteeringState state{offset, r};
      const Steered steered = steering.steer(state, 1e8);
      EXPECT_NEAR(offset_after(steered.command, state), 0.0, 1e-6);
      EXPECT_NEAR(steered.command.tracking_rate.ratio() * r, 1.0, 1e-15);
      EXPECT_FALSE(steered.stepped);
    }
  }
}

TEST(Steering, stretches_the_correction_where_the_rate_limit_binds) {
  SteeringLimits limits;
  limits.rate = RateLimits::symmetric_ppb(5e5);
  Steering steering{limits};
  const SteeringState state{1e6, 1.00005};
  const ServoCommand command = steering.steer(state, 1e8).command;
  EXPECT_GT(command.correction_time.ns(), 1e8);
  EXPECT_TRUE(limits.rate.contains(command.correction_rate));
  EXPECT_NEAR(offset_after(command, state), 0.0, 1e-3);
}

TEST(Steering, never_steps_unless_allowed_and_then_only_first) {
  SteeringLimits limits;
  limits.rate = RateLimits::symmetric_ppb(5e5);
  Steering never{limits};
  EXPECT_FALSE(never.steer({1e9, 1.0}, 1e8).stepped);
  limits.first_step_allowed = true;
  Steering once{limits};
  const Steered first = once.steer({1e9, 1.0}, 1e8);
  EXPECT_TRUE(first.stepped);
  EXPECT_NEAR(first.command.step.ns(), -1e9, 1e-6);
  EXPECT_FALSE(once.steer({1e9, 1.0}, 1e8).stepped);
  Steering small{limits};
  EXPECT_FALSE(small.steer({1e3, 1.0}, 1e8).stepped);
}

TEST(Steering, bounds_the_change_of_rate) {
  SteeringLimits limits;
  limits.rate_change = 1e-6;
  Steering steering{limits};
  (void)steering.steer({0.0, 1.0}, 1e8);
  const SteeringState state{1e4, 1.0};
  const ServoCommand command = steering.steer(state, 1e8).command;
  EXPECT_NEAR(command.correction_rate.ratio(), 1.0 - 1e-6, 1e-12);
  EXPECT_NEAR(offset_after(command, state), 0.0, 1e-3);
}

TEST(Steering, uses_only_rates_and_times_that_the_actuator_has) {
  SteeringLimits limits = wide();
  limits.rate_granularity = 1e-8;
  Steering coarse_rate{limits};
  const SteeringState state{777.0, 1.0};
  ServoCommand command = coarse_rate.steer(state, 1e8).command;
  const double lsb = command.correction_rate.deviation() / 1e-8;
  EXPECT_NEAR(lsb, std::round(lsb), 1e-6);
  EXPECT_NEAR(offset_after(command, state), 0.0, 1e-6);

  limits.rate_granularity = 0.0;
  limits.time_granularity = Nanoseconds{10'000'000};
  Steering coarse_time{limits};
  command = coarse_time.steer(state, 104e6).command;
  EXPECT_DOUBLE_EQ(command.correction_time.ns(), 1e8);
  EXPECT_NEAR(offset_after(command, state), 0.0, 1e-6);
}

TEST(Steering, knows_what_the_clock_does_until_the_command_takes_effect) {
  SteeringLimits limits = wide();
  limits.latency = Nanoseconds{1'000'000};
  Steering steering{limits};
  (void)steering.steer({0.0, 1.0}, 1e8);
  // The reference now turns out to run 100 ppm faster: for a millisecond more the clock loses 100
  // ns.
  const SteeringState state{0.0, 1.0 - 1e-4};
  const ServoCommand command = steering.steer(state, 1e8).command;
  const SteeringState at_effect{1e6 * (1.0 - 1.0 / (1.0 - 1e-4)), 1.0 - 1e-4};
  EXPECT_NEAR(offset_after(command, at_effect), 0.0, 1e-6);
}

}  // namespace
}  // namespace ftcs::adaptive
