// SPDX-License-Identifier: MIT
// Length: one world, and each rule of the discipline in it.
// World: one perfect oscillator that the test moves by hand; a reference that is an affine function
// of it; a virtual clock on it that the discipline steers. Exact stamps, path delay known (zero)
// unless a test says otherwise.
#include "ftcs/discipline/clock_discipline.h"

#include <cmath>
#include <limits>
#include <optional>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/manual_source.h"
#include "test/support/watched_clock.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::WatchedClock;

constexpr Nanoseconds kInterval = 125ms;
constexpr FreeRunningTime kStart = FreeRunningTime::from_ns(1'000'000'000);

class ClockDisciplineTest : public ::testing::Test {
 protected:
  ClockDisciplineTest() { oscillator_.instant = kStart; }

  void start(Duration offset, const DisciplineConfig& config) {
    clock_.emplace(oscillator_, offset, RateLimits::symmetric_ppb(100e6));
    discipline_.emplace(config, *clock_);
  }
  static DisciplineConfig config_for(ServoKind kind) {
    DisciplineConfig config;
    config.servo.kind = kind;
    config.servo.sync_interval = kInterval;
    config.servo.two_way.fixed_path_delay = 0ns;
    return config;
  }

  [[nodiscard]] ReferenceTime reference() {
    const Duration elapsed = oscillator_.now() - kStart;
    return ReferenceTime::from_ns(1'000'000'000) + scale(elapsed, reference_rate_) +
           reference_jump_;
  }
  [[nodiscard]] double offset_ns() {
    return offset_from_reference(clock_->read().local, reference()).ns();
  }
  [[nodiscard]] EventPair forward() {
    return {Direction::kForward, reference(), oscillator_.now()};
  }
  void advance(Duration elapsed) { oscillator_.instant = oscillator_.instant + elapsed; }
  Telemetry sync() { return discipline_->on_pair(forward()); }
  /// One message now, then an interval without any.
  Telemetry sync_and_wait() {
    const Telemetry telemetry = sync();
    advance(kInterval);
    return telemetry;
  }

  test::ManualSource oscillator_;
  Rate reference_rate_{};
  Duration reference_jump_{};
  std::optional<WatchedClock> clock_;
  std::optional<ClockDiscipline> discipline_;
};

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
      DisciplineConfig config = config_for(ServoKind::kFtcs);
      config.largest_offset = 1s;
      config.step.mode = may_step ? StepMode::kFirst : StepMode::kNever;
      reference_jump_ = Duration{};
      start(Nanoseconds{10us}, config);
      for (int n = 0; n < 8; ++n) sync_and_wait();
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
    DisciplineConfig config = config_for(ServoKind::kFtcs);
    config.largest_offset = 1s;
    config.step.mode = may_step ? StepMode::kFirst : StepMode::kNever;
    reference_jump_ = Duration{};
    start(Nanoseconds{10us}, config);
    for (int n = 0; n < 8; ++n) sync_and_wait();
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
    const test::ForbidAllocation guard;
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
}  // namespace ftcs
