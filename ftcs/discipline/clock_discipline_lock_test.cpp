// SPDX-License-Identifier: MIT
// World: discipline_fixture.h. What counts as locked, known and possible.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "ftcs/discipline/clock_discipline.h"
#include "test/support/discipline_fixture.h"
#include "test/support/forbid_allocation.h"

namespace ftcs::test {
namespace {

TEST_F(ClockDisciplineTest, the_free_running_servo_reports_and_leaves_the_clock_alone) {
  reference_rate_ = Rate::from_ppm(25.0);
  start(Nanoseconds{7us}, config_for(ServoKind::kFreeRunning));
  for (int n = 0; n < 3; ++n) EXPECT_FALSE(sync_and_wait().commanded);
  EXPECT_NEAR(discipline_->latest().servo.rate_ratio.ppm(), 25.0, 1e-6);
  EXPECT_NEAR(discipline_->latest().servo.offset.ns(), 7'000.0 - 2 * 3'125.0, 1e-3);
  EXPECT_EQ(discipline_->counters().commands, 0U);
}

TEST_F(ClockDisciplineTest, locks_after_the_dwell_and_loses_the_lock_outside_the_band) {
  DisciplineConfig config = config_for(ServoKind::kFreeRunning);
  config.lock = {{Nanoseconds{100}, Nanoseconds{1'000}}, 3};
  config.servo.two_way.gate_enabled = false;
  start(Nanoseconds{99}, config);
  EXPECT_FALSE(sync_and_wait().locked);
  EXPECT_FALSE(sync_and_wait().locked);
  EXPECT_TRUE(sync_and_wait().locked);
  reference_jump_ = Nanoseconds{-900};  // offset 999
  EXPECT_TRUE(sync_and_wait().locked);
  reference_jump_ = Nanoseconds{-901};
  EXPECT_FALSE(sync_and_wait().locked);
}

// A clock that is right by luck and half a ppm fast: s0 of linuxptp-pi measures for a while and
// steers nothing, and what nobody steers is not locked.
TEST_F(ClockDisciplineTest, does_not_lock_before_its_servo_steers) {
  DisciplineConfig config = config_for(ServoKind::kLinuxptpPi);
  config.lock = {{Nanoseconds{10'000}, Nanoseconds{20'000}}, 1};
  reference_rate_ = Rate::from_ppm(0.5);
  start(Nanoseconds{99}, config);
  int unlocked = 0;
  for (int n = 0; n < 40; ++n) {
    const Telemetry seen = sync_and_wait();
    if (seen.servo.state != ServoState::kUnlocked) continue;
    ++unlocked;
    EXPECT_FALSE(seen.locked);
  }
  EXPECT_GT(unlocked, 0);
  EXPECT_TRUE(discipline_->latest().locked);
}

TEST_F(ClockDisciplineTest, an_unknown_path_delay_is_no_offset_and_no_lock) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.servo.two_way.fixed_path_delay.reset();
  start(Duration{}, config);
  for (int n = 0; n < 8; ++n) {
    const Telemetry telemetry = sync_and_wait();
    EXPECT_FALSE(telemetry.servo.offset_known);
    EXPECT_FALSE(telemetry.commanded);
    EXPECT_FALSE(telemetry.locked);
  }
}

// Syncs alone say how fast the clock is, and what it is off by but for the length of the path.
TEST_F(ClockDisciplineTest, without_a_measured_path_delay_it_steers_but_is_not_locked_nor_sure) {
  DisciplineConfig config = config_for(ServoKind::kAdaptive);
  config.servo.two_way.fixed_path_delay.reset();
  start(Nanoseconds{5us}, config);
  Telemetry telemetry;
  for (int n = 0; n < 40; ++n) telemetry = sync_and_wait();
  EXPECT_GT(discipline_->counters().commands, 30U);
  EXPECT_FALSE(telemetry.locked);
  EXPECT_FALSE(discipline_->path_delay_known());
  EXPECT_TRUE(std::isnan(telemetry.servo.offset_sigma_ns));
  EXPECT_TRUE(std::isnan(discipline_->on_silence().servo.offset_sigma_ns));
  const auto answered = [&] {
    return discipline_->on_pair({Direction::kBackward, reference(), oscillator_.now()});
  };
  telemetry = answered();
  EXPECT_EQ(telemetry.verdict, SampleVerdict::kUsed);
  EXPECT_TRUE(discipline_->locked()) << "the first answer is what was missing";
  EXPECT_TRUE(std::isfinite(telemetry.servo.offset_sigma_ns));
  discipline_->on_new_reference();
  for (int n = 0; n < 40; ++n) telemetry = sync_and_wait();
  EXPECT_FALSE(telemetry.locked) << "another reference has another path";
}

TEST_F(ClockDisciplineTest, an_answer_makes_the_path_delay_known_once_an_exchange_is_whole) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.servo.two_way.fixed_path_delay.reset();
  start(Duration{}, config);
  const auto answered = [&] {
    return discipline_->on_pair({Direction::kBackward, reference(), oscillator_.now()});
  };
  EXPECT_EQ(answered().verdict, SampleVerdict::kRejected) << "of which Sync?";
  EXPECT_FALSE(discipline_->path_delay_known());
  sync_and_wait();
  EXPECT_EQ(answered().verdict, SampleVerdict::kUsed);
  EXPECT_FALSE(discipline_->path_delay_known()) << "one Sync tells no rate: it is kept";
  sync_and_wait();
  EXPECT_TRUE(discipline_->path_delay_known());
  discipline_->on_new_reference();
  EXPECT_FALSE(discipline_->path_delay_known());
}

TEST_F(ClockDisciplineTest, a_rate_that_is_no_number_is_refused_and_the_last_one_stays) {
  for (const double largest_rate_change : {0.0, 1e-3}) {
    DisciplineConfig config = config_for(ServoKind::kFtcs);
    config.largest_rate_change = largest_rate_change;
    start(Duration{}, config);
    ASSERT_FALSE(discipline_->start_at(Rate::from_ppm(20.0)));
    for (const double ratio :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
          -std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(discipline_->start_at(Rate::from_ratio(ratio)), ClockError::kNotFinite);
      const LocalTime before = clock_->read().local;
      advance(Nanoseconds{1s});
      EXPECT_NEAR((clock_->read().local - before).ns(), 1e9 + 20e3, 0.01);
    }
  }
}

/// Of somebody who divides by an interval of zero.
struct ServoWithoutANumber {
  ServoUpdate update(const TimestampPair&, const ClockReading&) noexcept {
    const Rate nothing = Rate::from_ratio(std::numeric_limits<double>::quiet_NaN());
    return {SampleVerdict::kUsed, true, {nothing, Duration{}, nothing, Duration{}}};
  }
  void reset() noexcept {}
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return {}; }
};

TEST_F(ClockDisciplineTest, a_servo_that_commands_no_number_is_told_so_and_moves_nothing) {
  start(Duration{}, config_for(ServoKind::kFtcs));
  BasicClockDiscipline<ServoWithoutANumber> discipline(
      {}, {}, *clock_, [](const RateLimits&) { return ServoWithoutANumber{}; });
  ASSERT_FALSE(discipline.start_at(Rate::from_ppm(20.0)));
  const Telemetry telemetry = discipline.on_pair(forward());
  EXPECT_EQ(telemetry.error, ClockError::kNotFinite);
  EXPECT_FALSE(telemetry.commanded);
  EXPECT_EQ(discipline.counters().apply_errors, 1U);
  EXPECT_EQ(discipline.counters().commands, 0U);
}

TEST_F(ClockDisciplineTest, a_path_delay_that_is_given_to_the_servo_itself_is_known) {
  for (const ServoKind kind :
       {ServoKind::kAdaptive, ServoKind::kKalman, ServoKind::kMinimumDelay}) {
    DisciplineConfig config = config_for(kind);
    config.servo.two_way.fixed_path_delay.reset();
    config.servo.adaptive.fixed_path_delay = 0ns;
    config.servo.kalman.fixed_path_delay = 0ns;
    config.servo.minimum_delay.fixed_path_delay = 0ns;
    start(Nanoseconds{0}, config);
    EXPECT_TRUE(discipline_->path_delay_known()) << servo_kind_name(kind);
  }
}

TEST_F(ClockDisciplineTest, a_jump_of_the_reference_beyond_the_bound_is_a_beginning) {
  for (const bool may_step : {false, true}) {
    lock_within_a_second(may_step);
    reference_jump_ = Nanoseconds{2s};
    const JumpPlan plan = discipline_->on_reference_jump(reference_jump_);
    sync_and_wait();
    const Telemetry telemetry = sync_and_wait();
    EXPECT_EQ(plan.response, may_step ? JumpResponse::kStepped : JumpResponse::kRefused);
    EXPECT_EQ(telemetry.offset_refused, !may_step);
    EXPECT_EQ(telemetry.step != Duration{}, may_step);
  }
}

TEST_F(ClockDisciplineTest, a_smaller_jump_is_slewed_and_the_time_that_takes_is_told) {
  DisciplineConfig config = config_for(ServoKind::kAdaptive);
  config.largest_offset = 1s;
  config.step.mode = StepMode::kFirst;
  config.servo.limits = RateLimits::symmetric_ppb(1e6);
  for (const Duration jump : {Duration{Nanoseconds{5ms}}, -Duration{Nanoseconds{5ms}}}) {
    reference_jump_ = Duration{};
    start(Nanoseconds{0}, config);
    for (int n = 0; n < 40; ++n) sync_and_wait();
    reference_jump_ = jump;
    const JumpPlan plan = discipline_->on_reference_jump(jump);
    EXPECT_EQ(plan.response, JumpResponse::kSlewed);
    EXPECT_NEAR(plan.slew.seconds(), 5.0, 0.1);
    const std::uint64_t steps = discipline_->counters().steps;
    double taken = 0.0;
    for (; std::abs(offset_ns()) > 100.0 && taken < 20.0; taken += 0.125) sync_and_wait();
    EXPECT_NEAR(taken, plan.slew.seconds(), 1.0);
    EXPECT_EQ(discipline_->counters().steps, steps);
  }
}

TEST_F(ClockDisciplineTest, allocates_nothing) {
  for (const ServoKindName& entry : kServoKinds) {
    start(Nanoseconds{1ms}, config_for(entry.kind));
    const ForbidAllocation guard;
    for (int n = 0; n < 50; ++n) {
      sync();
      discipline_->on_pair({Direction::kBackward, reference(), oscillator_.now()});
      advance(kInterval);
      discipline_->on_silence();
    }
    discipline_->on_new_reference();
  }
}

}  // namespace
}  // namespace ftcs::test
