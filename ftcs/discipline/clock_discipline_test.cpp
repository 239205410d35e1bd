// SPDX-License-Identifier: MIT
// World: discipline_fixture.h. Messages in time, late, lost and repeated; holdover; another
// reference.
#include "ftcs/discipline/clock_discipline.h"

#include <gtest/gtest.h>

#include "test/support/discipline_fixture.h"

namespace ftcs::test {
namespace {

TEST_F(ClockDisciplineTest, ftcs_is_on_the_reference_one_interval_after_its_first_action) {
  reference_rate_ = Rate::from_ppm(-50.0);
  start(Nanoseconds{1ms}, config_for(ServoKind::kFtcs));
  EXPECT_FALSE(sync_and_wait().commanded);
  const Telemetry acted = sync_and_wait();
  EXPECT_TRUE(acted.commanded);
  EXPECT_EQ(acted.servo.state, ServoState::kLocked);
  EXPECT_NEAR(acted.tracking_rate.ppm(), -50.0, 1e-6);
  EXPECT_LT(acted.applied_rate.ppm(), -8'000.0);
  EXPECT_EQ(acted.step, Duration{});
  advance(Nanoseconds{10us});  // 125 ms of this oscillator are 6 us less on the reference
  EXPECT_NEAR(offset_ns(), 0.0, 1e-3);
  EXPECT_EQ(discipline_->counters().used, 2U);
  EXPECT_EQ(discipline_->counters().commands, 1U);
}

TEST_F(ClockDisciplineTest, a_correction_ends_by_itself_when_the_next_sync_is_lost) {
  start(Nanoseconds{1ms}, config_for(ServoKind::kFtcs));
  sync_and_wait();
  sync_and_wait();  // 1 ms is being removed within 125 ms; from here on, nothing comes
  for (int n = 0; n < 80; ++n) {
    EXPECT_NEAR(offset_ns(), 0.0, 1e-3) << "after " << n << " lost messages";
    discipline_->on_silence();
    advance(kInterval);
  }
}

TEST_F(ClockDisciplineTest, late_handling_of_a_message_does_not_disturb) {
  reference_rate_ = Rate::from_ppm(20.0);
  start(Nanoseconds{500us}, config_for(ServoKind::kFtcs));
  for (int n = 0; n < 3; ++n) {
    const EventPair pair = forward();
    advance(Nanoseconds{20ms});  // Follow_Up comes late
    discipline_->on_pair(pair);
    advance(Nanoseconds{105ms});
  }
  EXPECT_NEAR(offset_ns(), 0.0, 0.1);
}

TEST_F(ClockDisciplineTest, missing_samples_mean_holdover_at_the_tracking_rate) {
  reference_rate_ = Rate::from_ppm(30.0);
  start(Nanoseconds{100us}, config_for(ServoKind::kFtcs));
  for (int n = 0; n < 3; ++n) sync_and_wait();
  for (int n = 0; n < 3; ++n) {
    EXPECT_NE(discipline_->on_silence().servo.state, ServoState::kHoldover);
    advance(kInterval);
  }
  EXPECT_NE(discipline_->on_silence().servo.state,
            ServoState::kHoldover);  // exactly four intervals
  advance(Nanoseconds{1});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover);
  EXPECT_FALSE(discipline_->locked());
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover);
  EXPECT_EQ(discipline_->counters().holdovers, 1U);
  advance(Nanoseconds{10s});
  EXPECT_NEAR(offset_ns(), 0.0, 0.1);
  EXPECT_EQ(sync().servo.state, ServoState::kLocked);
}

TEST_F(ClockDisciplineTest, holdover_begins_after_four_intervals_whatever_the_servo) {
  for (const ServoKind kind : {ServoKind::kFtcs, ServoKind::kPics, ServoKind::kLinuxptpPi,
                               ServoKind::kAdaptive, ServoKind::kRegression, ServoKind::kKalman}) {
    start(Duration{}, config_for(kind));
    for (int n = 0; n < 20; ++n) sync_and_wait();
    advance(3 * kInterval);
    EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kLocked) << servo_kind_name(kind);
    advance(Nanoseconds{1});
    EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover)
        << servo_kind_name(kind);
  }
}

/// Asked in front of the servo: what is no news does not reach it, and is counted.
TEST_F(ClockDisciplineTest, a_reference_that_was_set_back_is_followed_at_the_third_message) {
  for (const ServoKind kind : {ServoKind::kFtcs, ServoKind::kAdaptive, ServoKind::kPid}) {
    reference_jump_ = Duration{};
    start(Duration{}, config_for(kind));
    for (int n = 0; n < 20; ++n) sync_and_wait();
    reference_jump_ = Nanoseconds{-10s};
    EXPECT_EQ(sync_and_wait().verdict, SampleVerdict::kImplausible) << servo_kind_name(kind);
    EXPECT_EQ(sync_and_wait().verdict, SampleVerdict::kImplausible) << servo_kind_name(kind);
    EXPECT_EQ(sync_and_wait().verdict, SampleVerdict::kUsed) << servo_kind_name(kind);
    EXPECT_EQ(discipline_->counters().implausible, 2U) << servo_kind_name(kind);
  }
}

TEST_F(ClockDisciplineTest, messages_that_do_not_steer_do_not_prevent_holdover) {
  start(Duration{}, config_for(ServoKind::kFtcs));
  for (int n = 0; n < 20; ++n) sync_and_wait();
  const EventPair old = forward();
  discipline_->on_pair(old);
  for (int n = 0; n < 5; ++n) {
    advance(kInterval);
    discipline_->on_pair(old);
    discipline_->on_pair({Direction::kBackward, reference(), oscillator_.now()});
  }
  EXPECT_EQ(discipline_->latest().servo.state, ServoState::kHoldover);
}

TEST_F(ClockDisciplineTest, no_holdover_before_the_first_sample) {
  start(Duration{}, config_for(ServoKind::kFtcs));
  advance(Nanoseconds{60s});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kUnlocked);
  EXPECT_EQ(discipline_->counters().holdovers, 0U);
}

TEST_F(ClockDisciplineTest, holdover_uses_the_measured_interval_where_none_is_configured) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.servo.sync_interval = 0ns;
  start(Duration{}, config);
  sync();
  advance(Nanoseconds{60s});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kUnlocked);  // no interval known yet
  sync();
  advance(Nanoseconds{1s});
  sync();
  advance(Nanoseconds{4s});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kLocked);
  advance(Nanoseconds{1});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover);
}

TEST_F(ClockDisciplineTest, an_outage_is_not_taken_for_the_interval) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.servo.sync_interval = 0ns;
  start(Duration{}, config);
  for (int n = 0; n < 8; ++n) sync_and_wait();
  advance(Nanoseconds{100s});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover);
  EXPECT_NE(sync().servo.state, ServoState::kHoldover);  // a single message, and silence again
  advance(Nanoseconds{1s});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover);
  EXPECT_FALSE(discipline_->locked());
}

TEST_F(ClockDisciplineTest, a_burst_is_not_taken_for_the_interval_that_was_announced) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.servo.sync_interval = 0ns;
  start(Duration{}, config);
  discipline_->on_announced_interval(kInterval);
  for (int n = 0; n < 3; ++n) {  // held up together
    sync();
    advance(Nanoseconds{5ms});
  }
  advance(4 * kInterval - Nanoseconds{5ms});
  EXPECT_NE(discipline_->on_silence().servo.state, ServoState::kHoldover);
  advance(Nanoseconds{1});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover);
}

TEST_F(ClockDisciplineTest, a_longer_interval_is_learnt_from_two_gaps) {
  DisciplineConfig config = config_for(ServoKind::kFtcs);
  config.servo.sync_interval = 0ns;
  start(Duration{}, config);
  for (int n = 0; n < 8; ++n) sync_and_wait();
  for (int n = 0; n < 3; ++n) {
    sync();
    advance(Nanoseconds{1s});
  }
  EXPECT_NE(discipline_->on_silence().servo.state, ServoState::kHoldover);
}

TEST_F(ClockDisciplineTest, a_new_reference_starts_the_servo_again_and_keeps_the_rate) {
  reference_rate_ = Rate::from_ppm(40.0);
  start(Nanoseconds{10us}, config_for(ServoKind::kFtcs));
  for (int n = 0; n < 8; ++n) sync_and_wait();
  EXPECT_TRUE(discipline_->locked());
  discipline_->on_new_reference();
  EXPECT_FALSE(discipline_->locked());
  EXPECT_EQ(discipline_->latest().servo.state, ServoState::kUnlocked);
  EXPECT_FALSE(discipline_->latest().servo.offset_known);
  EXPECT_NEAR(discipline_->latest().tracking_rate.ppm(), 40.0, 1e-6);
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kUnlocked);
  advance(Nanoseconds{60s});
  EXPECT_EQ(discipline_->on_silence().servo.state, ServoState::kHoldover) << "it says nothing";
  EXPECT_EQ(discipline_->counters().holdovers, 1U);
  reference_jump_ = Nanoseconds{-5s};  // the other transmitter lives elsewhere
  EXPECT_EQ(sync_and_wait().verdict, SampleVerdict::kUsed);
  EXPECT_EQ(discipline_->counters().new_references, 1U);
  EXPECT_EQ(discipline_->counters().implausible, 0U);
  reference_jump_ = Nanoseconds{-9s};  // the same one, with its time set
  EXPECT_EQ(sync_and_wait().verdict, SampleVerdict::kImplausible);
  EXPECT_EQ(discipline_->counters().implausible, 1U);
}

}  // namespace
}  // namespace ftcs::test
