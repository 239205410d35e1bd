// SPDX-License-Identifier: MIT
// World: discipline_fixture.h. Steps, and what must not reach a clock.
#include <cmath>

#include <gtest/gtest.h>

#include "ftcs/discipline/clock_discipline.h"
#include "test/support/discipline_fixture.h"

namespace ftcs::test {
namespace {

TEST_F(ClockDisciplineTest, never_steps_unless_the_policy_permits_it) {
  DisciplineConfig config = config_for(ServoKind::kLinuxptpPi);
  start(Nanoseconds{1ms}, config);
  sync_and_wait();
  const Telemetry acted = sync_and_wait();
  EXPECT_TRUE(acted.commanded);
  EXPECT_EQ(acted.step, Duration{});  // ptp4l would have stepped
  EXPECT_EQ(discipline_->counters().steps, 0U);
  EXPECT_NEAR(offset_ns(), 1e6, 1.0);
}

TEST_F(ClockDisciplineTest, lets_linuxptp_pi_take_its_first_step) {
  DisciplineConfig config = config_for(ServoKind::kLinuxptpPi);
  config.step.mode = StepMode::kFirst;
  config.step.threshold = 1ns;  // not asked: this servo decides itself
  start(Nanoseconds{1ms}, config);
  sync_and_wait();
  EXPECT_EQ(sync_and_wait().step, Duration{Nanoseconds{-1ms}});
  EXPECT_NEAR(offset_ns(), 0.0, 1.0);
  reference_jump_ = Nanoseconds{10us};
  EXPECT_EQ(sync_and_wait().step, Duration{});
  EXPECT_EQ(discipline_->counters().steps, 1U);
}

TEST_F(ClockDisciplineTest, steps_for_ftcs_with_the_first_command_only) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.step = {StepMode::kFirst, 20us};
  config.servo.two_way.gate_enabled = false;
  reference_rate_ = Rate::from_ppm(-50.0);
  start(Nanoseconds{3s}, config);
  sync_and_wait();
  EXPECT_NEAR(sync_and_wait().step.ns(), -3e9, 1e4);
  EXPECT_NEAR(offset_ns(), 0.0, 1e-3);
  reference_jump_ = Nanoseconds{1ms};
  EXPECT_EQ(sync_and_wait().step, Duration{});
}

TEST_F(ClockDisciplineTest, steps_whenever_the_policy_says_always) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.step = {StepMode::kAlways, 20us};
  config.servo.two_way.gate_enabled = false;
  start(Nanoseconds{20us}, config);
  sync_and_wait();
  EXPECT_EQ(sync_and_wait().step, Duration{});  // at the threshold is not above it
  sync_and_wait();
  reference_jump_ = Nanoseconds{1ms};
  EXPECT_NE(sync_and_wait().step, Duration{});
  EXPECT_EQ(discipline_->counters().steps, 1U);
}

TEST_F(ClockDisciplineTest, a_step_does_not_kick_the_incremental_pi) {
  DisciplineConfig config = config_for(ServoKind::kPics);
  config.step = {StepMode::kFirst, 5us};
  start(Nanoseconds{10us}, config);
  const Telemetry stepped = sync_and_wait();
  EXPECT_EQ(stepped.step, Duration{Nanoseconds{-10us}});
  EXPECT_NEAR(stepped.applied_rate.ppm(), -80.0, 1e-6);  // K_i e / T, which the step made needless
  // Now 10 us behind: e - e(-1) is 10 us, because e(-1) became zero by the step; unshifted it would
  // be 20 us.
  EXPECT_NEAR(sync_and_wait().applied_rate.ppm(), -80.0 + 80.0 + 80.0, 1e-6);
  sync_and_wait();
  EXPECT_NEAR(offset_ns(), 0.0, 1e-3);
}

TEST_F(ClockDisciplineTest, refuses_an_absurd_first_offset) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.largest_offset = 1s;
  start(Nanoseconds{1'000'000'001ns}, config);
  for (int n = 0; n < 4; ++n) {
    const Telemetry telemetry = sync_and_wait();
    EXPECT_FALSE(telemetry.commanded);
    EXPECT_EQ(telemetry.offset_refused, n > 0);
  }
  EXPECT_EQ(discipline_->counters().refused, 3U);
  start(Nanoseconds{1s}, config);
  sync_and_wait();
  EXPECT_TRUE(sync_and_wait().commanded);
  config.step.mode = StepMode::kFirst;
  start(Nanoseconds{2s}, config);
  sync_and_wait();
  EXPECT_TRUE(sync_and_wait().commanded);
  EXPECT_NEAR(offset_ns(), 0.0, 1e-3);
}

TEST_F(ClockDisciplineTest, tells_the_rate_in_force_after_a_correction_that_nothing_followed) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.largest_offset = 1s;
  start(Nanoseconds{100us}, config);
  sync_and_wait();
  const Telemetry slews = sync_and_wait();
  EXPECT_GT(std::abs(slews.applied_rate.ppb() - slews.tracking_rate.ppb()), 1e4);
  reference_jump_ = Nanoseconds{10s};
  for (int n = 0; n < 3; ++n) sync_and_wait();
  const Telemetry refused = sync_and_wait();
  EXPECT_FALSE(refused.commanded);
  EXPECT_EQ(refused.applied_rate, refused.tracking_rate);
}

// A transmitter that is better by its own word and 10 s off ran the clock at 3 % for as long as it
// liked.
TEST_F(ClockDisciplineTest, no_offset_beyond_the_bound_is_followed_at_any_time) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.largest_offset = 1s;
  reference_rate_ = Rate::from_ppm(40.0);
  start(Nanoseconds{10us}, config);
  for (int n = 0; n < 8; ++n) sync_and_wait();
  const std::uint64_t commands = discipline_->counters().commands;
  discipline_->on_new_reference();
  reference_jump_ = Nanoseconds{10s};
  for (int n = 0; n < 100; ++n) sync_and_wait();
  EXPECT_EQ(discipline_->counters().commands, commands);
  EXPECT_GE(discipline_->counters().refused, 99U);
  EXPECT_FALSE(discipline_->locked());
  reference_jump_ = Duration{};
  discipline_->on_new_reference();
  for (int n = 0; n < 8; ++n) sync_and_wait();
  EXPECT_TRUE(discipline_->locked()) << "back at once, at the rate that was kept";
}

TEST_F(ClockDisciplineTest, another_timescale_is_a_beginning_and_another_transmitter_is_none) {
  for (const bool may_step : {false, true}) {
    for (const bool timescale : {false, true}) {
      lock_within_a_second(may_step);
      const std::uint64_t steps = discipline_->counters().steps;
      if (timescale) {
        discipline_->on_new_timescale();
      } else {
        discipline_->on_new_reference();
      }
      reference_jump_ = Nanoseconds{-2s};
      sync_and_wait();
      const Telemetry telemetry = sync_and_wait();
      EXPECT_EQ(telemetry.offset_refused, !(timescale && may_step));
      EXPECT_EQ(discipline_->counters().steps - steps, timescale && may_step ? 1U : 0U);
      EXPECT_EQ(discipline_->counters().new_references, 1U);
    }
  }
}

TEST_F(ClockDisciplineTest, no_rate_beyond_either_limit_reaches_the_clock) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.servo.limits = {Rate::from_ppm(-1000.0), Rate::from_ratio(1.5)};
  start(Nanoseconds{-100ms},
        config);  // 800,000 ppm to catch up in one interval; the clock takes 100,000
  sync_and_wait();
  EXPECT_NEAR(sync_and_wait().applied_rate.ppm(), 100'000.0, 1e-6);
  EXPECT_EQ(discipline_->counters().clamps, 1U);
  start(Nanoseconds{100ms}, config);
  sync_and_wait();
  EXPECT_NEAR(sync_and_wait().applied_rate.ppm(), -1000.0, 1e-6);
  EXPECT_EQ(discipline_->counters().clamps, 1U);
}

TEST_F(ClockDisciplineTest, a_refused_command_is_reported_and_the_next_one_repairs_it) {
  start(Nanoseconds{1ms}, config_for(ServoKind::kFtcs));
  sync_and_wait();
  clock_->refuse = true;
  const Telemetry failed = sync_and_wait();
  EXPECT_FALSE(failed.commanded);
  EXPECT_EQ(failed.error, ClockError::kBusy);
  EXPECT_EQ(discipline_->counters().apply_errors, 1U);
  EXPECT_NEAR(offset_ns(), 1e6, 1e-3);
  clock_->refuse = false;
  const Telemetry worked = sync_and_wait();
  EXPECT_TRUE(worked.commanded);
  EXPECT_EQ(worked.error, std::nullopt);
}

TEST_F(ClockDisciplineTest, counts_what_became_of_every_message) {
  start(Duration{}, config_for(ServoKind::kFtcs));
  for (int n = 0; n < 20; ++n) sync_and_wait();
  const EventPair pair = forward();
  discipline_->on_pair(pair);
  discipline_->on_pair(pair);
  advance(kInterval);
  EventPair outlier = forward();
  outlier.reference = outlier.reference - Nanoseconds{50us};  // arrives 50 us late
  const Telemetry rejected = discipline_->on_pair(outlier);
  EXPECT_EQ(rejected.verdict, SampleVerdict::kRejected);
  EXPECT_FALSE(rejected.commanded);
  discipline_->on_pair({Direction::kBackward, reference(), oscillator_.now()});
  const DisciplineCounters& counters = discipline_->counters();
  EXPECT_EQ(counters.used, 21U);
  EXPECT_EQ(counters.duplicate, 1U);
  EXPECT_EQ(counters.rejected, 1U);
  EXPECT_EQ(counters.backward, 1U);
  EXPECT_EQ(counters.implausible, 0U);
  EXPECT_EQ(counters.commands, 20U);
  EXPECT_EQ(counters.clamps, 0U);
}

}  // namespace
}  // namespace ftcs::test
