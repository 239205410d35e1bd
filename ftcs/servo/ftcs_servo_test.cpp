// SPDX-License-Identifier: MIT
// World: a perfect oscillator, a reference that is an affine function of it, exact stamps; what the
// servo commands is applied at once unless a test says otherwise. offset = local - reference.
#include "ftcs/servo/ftcs_servo.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/affine_plant.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::AffinePlant;

constexpr Nanoseconds kInterval = 125ms;

FtcsConfig deadbeat() {
  FtcsConfig config;
  config.sync_interval = kInterval;
  config.offset_gain = 1.0;
  return config;
}

FtcsConfig with_gain(double offset_gain) {
  FtcsConfig config = deadbeat();
  config.offset_gain = offset_gain;
  return config;
}

/// Feeds a sample of now and applies what comes out.
ServoUpdate step(FtcsServo& servo, AffinePlant& plant) {
  const ServoUpdate update = servo.update(plant.sample(), plant.read());
  if (update.has_command) plant.apply(update.command);
  return update;
}

SyncSample sample_at(std::int64_t origin_ns, std::int64_t free_running_ns,
                     std::int64_t offset_ns = 0) {
  return {ReferenceTime::from_ns(origin_ns), Duration{}, LocalTime::from_ns(origin_ns + offset_ns),
          FreeRunningTime::from_ns(free_running_ns)};
}

ClockReading at(const SyncSample& sample) { return {sample.free_running, sample.local}; }

TEST(FtcsServo, removes_skew_and_offset_one_interval_after_priming) {
  AffinePlant plant{1.0L / (1.0L + 50e-6L), 1ms};  // local 50 ppm fast, 1 ms ahead
  FtcsServo servo{deadbeat()};
  EXPECT_FALSE(step(servo, plant).has_command);
  EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
  plant.advance_reference(kInterval);
  EXPECT_NEAR(plant.offset_ns(), 1'006'250.0, 1e-3);
  EXPECT_TRUE(step(servo, plant).has_command);
  EXPECT_EQ(servo.snapshot().state, ServoState::kLocked);
  plant.advance_reference(kInterval);
  EXPECT_NEAR(plant.offset_ns(), 0.0, 1e-6);
  EXPECT_TRUE(step(servo, plant).has_command);
  plant.advance_reference(kInterval);
  EXPECT_NEAR(plant.offset_ns(), 0.0, 1e-6);
}

TEST(FtcsServo, commands_equation_18_to_the_letter) {
  FtcsServo servo{deadbeat()};
  const SyncSample first = sample_at(0, 0);
  const SyncSample second = sample_at(125'000'000, 125'001'250, -1'000'000);  // 1 ms behind
  (void)servo.update(first, at(first));
  const ServoUpdate update = servo.update(second, at(second));
  const double ka = 125'000'000.0 / 125'001'250.0;
  ASSERT_TRUE(update.has_command);
  EXPECT_EQ(update.command.tracking_rate.ratio(), ka);
  EXPECT_NEAR(update.command.correction_rate.ratio(), (1.0 + 1e6 / 125e6) * ka, 1e-15);
  EXPECT_EQ(update.command.correction_time, Duration{kInterval});
  EXPECT_EQ(update.command.step, Duration{});
  EXPECT_EQ(servo.snapshot().rate_ratio.ratio(), ka);
  EXPECT_EQ(servo.snapshot().offset, Duration{Nanoseconds{-1'000'000}});
  EXPECT_EQ(servo.snapshot().offset_gain, 1.0);
}

TEST(FtcsServo, with_a_shorter_correction_time_follows_equation_17) {
  FtcsConfig config = deadbeat();
  config.correction_time = 25ms;
  AffinePlant plant{1.0L + 200e-6L, -300us};
  FtcsServo servo{config};
  step(servo, plant);
  plant.advance_reference(kInterval);
  const double before = plant.offset_ns();
  step(servo, plant);
  plant.advance_reference(Duration{12'500us});
  EXPECT_NEAR(plant.offset_ns(), before / 2.0, 1e-3);
  plant.advance_reference(Duration{12'500us});
  EXPECT_NEAR(plant.offset_ns(), 0.0, 1e-6);
  plant.advance_reference(Duration{100ms});
  EXPECT_NEAR(plant.offset_ns(), 0.0, 1e-6);
}

TEST(FtcsServo, latency_between_sample_and_command_costs_nothing) {
  AffinePlant plant{1.0L - 80e-6L, 2ms};
  FtcsServo servo{deadbeat()};
  for (int n = 0; n < 4; ++n) {
    const SyncSample sample = plant.sample();
    plant.advance_reference(Duration{7ms});  // the old command stays in force meanwhile
    const ServoUpdate update = servo.update(sample, plant.read());
    if (update.has_command) plant.apply(update.command);
    plant.advance_reference(Duration{118ms});
  }
  // The fourth sample was taken inside the third correction, and its command came after it.
  EXPECT_NEAR(plant.offset_ns(), 0.0, 1e-6);
}

TEST(FtcsServo, the_correction_ends_one_correction_time_after_the_sample) {
  // The reference runs 0.1 % fast: 10 ms of oscillator are 10.01 ms of it.
  const auto correction_time_after = [](Nanoseconds latency) {
    FtcsServo servo{deadbeat()};
    const SyncSample first = sample_at(0, 0);
    const SyncSample second = sample_at(125'125'000, 125'000'000);
    (void)servo.update(first, at(first));
    return servo.update(second, {second.free_running + latency, second.local + latency})
        .command.correction_time.ns();
  };
  EXPECT_NEAR(correction_time_after(10ms), 125e6 - 10.01e6, 1e-3);
  EXPECT_NEAR(correction_time_after(62ms), 125e6 - 62.062e6, 1e-3);
  EXPECT_EQ(correction_time_after(63ms), 62.5e6);  // no less than half of T_c
  EXPECT_EQ(correction_time_after(1s), 62.5e6);
}

TEST(FtcsServo, a_change_of_the_path_delay_does_not_look_like_frequency) {
  FtcsServo servo{deadbeat()};
  SyncSample first = sample_at(0, 0);
  SyncSample second = sample_at(125'000'000, 125'000'000);
  first.path_delay = Nanoseconds{10'000};
  second.path_delay = Nanoseconds{4'000};
  (void)servo.update(first, at(first));
  const ServoUpdate update = servo.update(second, at(second));
  EXPECT_EQ(update.command.tracking_rate, Rate{});
  EXPECT_EQ(servo.snapshot().offset, Duration{Nanoseconds{-4'000}});
  EXPECT_EQ(servo.snapshot().path_delay, Duration{Nanoseconds{4'000}});
}

TEST(FtcsServo, acts_once_with_full_weight_then_with_the_offset_gain) {
  AffinePlant plant{1.0L, 1ms};
  FtcsServo servo{with_gain(0.25)};
  step(servo, plant);
  plant.advance_reference(kInterval);
  step(servo, plant);
  EXPECT_EQ(servo.snapshot().offset_gain, 1.0);
  plant.advance_reference(kInterval);
  plant.apply(
      {Rate{}, Duration{}, Rate{}, Duration{Nanoseconds{8us}}});  // a disturbance: 8 us ahead
  step(servo, plant);
  EXPECT_EQ(servo.snapshot().offset_gain, 0.25);
  plant.advance_reference(kInterval);
  EXPECT_NEAR(plant.offset_ns(), 6'000.0, 1e-6);  // (1 - p) of it is left   (19)
}

TEST(FtcsServo, with_dwell_zero_the_gain_may_apply_from_the_first_action_on) {
  FtcsConfig config = with_gain(0.25);
  config.converged_dwell = 0;
  AffinePlant plant{1.0L, 1ms};
  FtcsServo servo{config};
  step(servo, plant);
  plant.advance_reference(kInterval);
  step(servo, plant);
  EXPECT_EQ(servo.snapshot().offset_gain, 0.25);
}

/// The gain that the servo uses for each of a series of offsets, in ns, after one priming sample.
std::vector<double> gains_for(const FtcsConfig& config, const std::vector<std::int64_t>& offsets) {
  FtcsServo servo{config};
  std::vector<double> gains;
  (void)servo.update(sample_at(0, 0), at(sample_at(0, 0)));
  std::int64_t now = 0;
  for (const std::int64_t offset : offsets) {
    now += 125'000'000;
    const SyncSample sample = sample_at(now, now, offset);
    (void)servo.update(sample, at(sample));
    gains.push_back(servo.snapshot().offset_gain);
  }
  return gains;
}

TEST(FtcsServo, equal_enter_and_leave_are_the_memoryless_switch_of_table_1) {
  FtcsConfig config = with_gain(0.5);
  config.converged_band = {Nanoseconds{500}, Nanoseconds{500}};
  config.converged_dwell = 0;
  EXPECT_EQ(gains_for(config, {499, 500, -499, -500, 0, 700, 1}),
            (std::vector<double>{0.5, 1.0, 0.5, 1.0, 0.5, 1.0, 0.5}));
}

TEST(FtcsServo, the_band_has_hysteresis) {
  FtcsConfig config = with_gain(0.5);
  config.converged_band = {Nanoseconds{50}, Nanoseconds{500}};
  // First action, at the edge, inside, between, between, left, between, inside.
  EXPECT_EQ(gains_for(config, {10, 50, -49, 499, -60, -500, 60, 49}),
            (std::vector<double>{1.0, 1.0, 0.5, 0.5, 0.5, 1.0, 1.0, 0.5}));
}

TEST(FtcsServo, the_dwell_counts_consecutive_samples_inside_the_band) {
  FtcsConfig config = with_gain(0.5);
  config.converged_band = {Nanoseconds{50}, Nanoseconds{500}};
  config.converged_dwell = 3;
  EXPECT_EQ(gains_for(config, {10, 10, 10, 60, 10, 10, 10, 600, 10, 10, 10}),
            (std::vector<double>{1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5, 1.0, 1.0, 1.0, 0.5}));
}

TEST(FtcsServo, a_gain_of_zero_tracks_the_frequency_alone) {
  AffinePlant plant{1.0L + 1e-4L, 0ns};
  FtcsServo servo{with_gain(0.0)};
  step(servo, plant);
  plant.advance_reference(kInterval);
  step(servo, plant);
  plant.advance_reference(kInterval);
  plant.apply({Rate::from_ratio(1.0001), Duration{}, Rate::from_ratio(1.0001), Duration{5us}});
  for (int n = 0; n < 5; ++n) {
    const ServoUpdate update = step(servo, plant);
    EXPECT_EQ(update.command.correction_rate, update.command.tracking_rate);
    plant.advance_reference(kInterval);
  }
  EXPECT_NEAR(plant.offset_ns(), 5'000.0, 1e-4);
}

TEST(FtcsServo, limits_hold_for_the_correction_and_for_the_tracking_rate) {
  FtcsConfig config = deadbeat();
  config.limits = RateLimits::symmetric_ppb(500'000.0);
  FtcsServo servo{config};
  const SyncSample first = sample_at(0, 0);
  const SyncSample behind = sample_at(125'000'000, 125'000'000, -1'000'000);
  const SyncSample ahead = sample_at(250'000'000, 250'000'000, 1'000'000);
  const SyncSample fast_reference = sample_at(375'125'000, 375'000'000);  // 1000 ppm
  (void)servo.update(first, at(first));
  EXPECT_EQ(servo.update(behind, at(behind)).command.correction_rate, config.limits.fastest);
  EXPECT_EQ(servo.update(ahead, at(ahead)).command.correction_rate, config.limits.slowest);
  const ServoUpdate update = servo.update(fast_reference, at(fast_reference));
  EXPECT_EQ(update.command.tracking_rate, config.limits.fastest);
  EXPECT_NEAR(servo.snapshot().rate_ratio.ppm(), 1000.0, 1e-6);  // what was measured is not hidden
}

TEST(FtcsServo, the_first_action_goes_on_until_the_limits_let_it_through) {
  FtcsConfig config = with_gain(0.25);
  config.limits = RateLimits::symmetric_ppb(1e6);  // 125 us an interval
  AffinePlant plant{1.0L, 300us};
  FtcsServo servo{config};
  step(servo, plant);
  for (const double left_ns : {175'000.0, 50'000.0, 0.0}) {
    plant.advance_reference(kInterval);
    step(servo, plant);
    EXPECT_EQ(servo.snapshot().offset_gain, 1.0);
    AffinePlant later = plant;
    later.advance_reference(kInterval);
    EXPECT_NEAR(later.offset_ns(), left_ns, 1e-3);
  }
  plant.advance_reference(kInterval);
  step(servo, plant);
  EXPECT_EQ(servo.snapshot().offset_gain, 0.25);
}

TEST(FtcsServo, measures_the_interval_when_none_is_configured) {
  FtcsServo servo{};
  const SyncSample first = sample_at(0, 0);
  const SyncSample second = sample_at(80'000, 80'000);
  const SyncSample after_a_gap = sample_at(400'000, 400'000);
  (void)servo.update(first, at(first));
  EXPECT_EQ(servo.update(second, at(second)).command.correction_time, Duration{80us});
  // A lost message does not make the interval longer.
  EXPECT_EQ(servo.update(after_a_gap, at(after_a_gap)).command.correction_time, Duration{80us});
}

TEST(FtcsServo, removes_what_an_outage_left_with_full_weight) {
  for (const Nanoseconds configured : {kInterval, Nanoseconds{0}}) {
    AffinePlant plant{1.0L, 0ns};
    FtcsConfig config = with_gain(1.0 / 16.0);
    config.sync_interval = configured;
    FtcsServo servo{config};
    for (int i = 0; i < 4; ++i) {
      step(servo, plant);
      plant.advance_reference(kInterval);
    }
    plant.advance_reference(Duration{375ms});  // four intervals: messages were lost, no more
    step(servo, plant);
    EXPECT_EQ(servo.snapshot().offset_gain, 1.0 / 16.0);
    plant.advance_reference(kInterval);
    step(servo, plant);
    plant.advance_reference(Duration{501ms});
    step(servo, plant);
    EXPECT_EQ(servo.snapshot().offset_gain, 1.0);
    plant.advance_reference(kInterval);
    step(servo, plant);
    EXPECT_EQ(servo.snapshot().offset_gain, 1.0 / 16.0);
  }
}

TEST(FtcsServo, lands_in_spite_of_missing_samples_and_irregular_intervals) {
  AffinePlant plant{1.0L + 30e-6L, 1ms};
  FtcsServo servo{deadbeat()};
  step(servo, plant);
  for (const auto gap : {125ms, 125ms, 500ms, 131ms, 250ms, 119ms, 125ms}) {
    plant.advance_reference(Duration{gap});
    step(servo, plant);
  }
  plant.advance_reference(Duration{125ms});
  EXPECT_NEAR(plant.offset_ns(), 0.0, 1e-6);
}

TEST(FtcsServo, ignores_repeated_and_late_samples) {
  AffinePlant plant{1.0L + 1e-5L, 1ms};
  FtcsServo servo{deadbeat()};
  step(servo, plant);
  const SyncSample late = plant.sample();
  plant.advance_reference(kInterval);
  const SyncSample sample = plant.sample();
  step(servo, plant);
  const ServoSnapshot before = servo.snapshot();
  for (const SyncSample& again : {sample, late}) {
    const ServoUpdate update = servo.update(again, plant.read());
    EXPECT_EQ(update.verdict, SampleVerdict::kDuplicate);
    EXPECT_FALSE(update.has_command);
  }
  EXPECT_EQ(servo.snapshot().offset, before.offset);
  plant.advance_reference(kInterval);
  const ServoUpdate update = step(servo, plant);
  EXPECT_NEAR(update.command.tracking_rate.ppm(), 10.0, 1e-6);
}

TEST(FtcsServo, starts_again_when_one_of_the_clocks_jumped) {
  const SyncSample first = sample_at(10'000'000'000, 10'000'000'000);
  const SyncSample good = sample_at(10'125'000'000, 10'125'000'000);
  const SyncSample reference_back = sample_at(9'250'000'000, 10'250'000'000);
  const SyncSample reference_on = sample_at(11'250'000'000, 10'250'000'000);
  const SyncSample oscillator_back = sample_at(10'250'000'000, 9'000'000'000);
  for (const SyncSample& jump : {reference_back, reference_on, oscillator_back}) {
    FtcsServo servo{with_gain(0.5)};
    (void)servo.update(first, at(first));
    (void)servo.update(good, at(good));
    const ServoUpdate update = servo.update(jump, at(jump));
    EXPECT_EQ(update.verdict, SampleVerdict::kImplausible);
    EXPECT_FALSE(update.has_command);
    EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
    SyncSample next = jump;
    next.origin = jump.origin + kInterval;
    next.local = jump.local + kInterval;
    next.free_running = jump.free_running + kInterval;
    EXPECT_TRUE(servo.update(next, at(next)).has_command);
    EXPECT_EQ(servo.snapshot().rate_ratio, Rate{});
    EXPECT_EQ(servo.snapshot().offset_gain, 1.0);
  }
}

TEST(FtcsServo, a_counter_that_wraps_is_no_event) {
  constexpr std::int64_t kTop = std::numeric_limits<std::int64_t>::max();
  const SyncSample first = sample_at(0, kTop - 62'499'999);
  const SyncSample second = sample_at(125'000'000, -(kTop - 62'499'999));  // 125 ms + 1 ns later
  FtcsServo servo{deadbeat()};
  (void)servo.update(first, at(first));
  const ServoUpdate update = servo.update(second, at(second));
  EXPECT_EQ(update.verdict, SampleVerdict::kUsed);
  EXPECT_NEAR(update.command.tracking_rate.ratio(), 1.0, 2e-8);
}

TEST(FtcsServo, reset_means_two_samples_and_full_weight_again) {
  AffinePlant plant{1.0L, 1ms};
  FtcsServo servo{with_gain(0.25)};
  for (int n = 0; n < 3; ++n) {
    step(servo, plant);
    plant.advance_reference(kInterval);
  }
  EXPECT_EQ(servo.snapshot().offset_gain, 0.25);
  servo.reset();
  EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
  EXPECT_FALSE(step(servo, plant).has_command);
  plant.advance_reference(kInterval);
  EXPECT_TRUE(step(servo, plant).has_command);
  EXPECT_EQ(servo.snapshot().offset_gain, 1.0);
}

TEST(FtcsServo, priming_counts_as_the_first_sample_and_only_once) {
  AffinePlant plant{1.0L + 20e-6L, 0ns};
  FtcsServo servo{deadbeat()};
  servo.prime(plant.sample());
  plant.advance_reference(kInterval);
  servo.prime(plant.sample(Duration{1us}));  // no effect: not empty
  const ServoUpdate update = step(servo, plant);
  EXPECT_TRUE(update.has_command);
  EXPECT_NEAR(update.command.tracking_rate.ppm(), 20.0, 1e-6);
}

TEST(FtcsServo, allocates_nothing) {
  AffinePlant plant{1.0L, 1ms};
  const test::ForbidAllocation guard;
  FtcsServo servo{deadbeat()};
  for (int n = 0; n < 10; ++n) {
    step(servo, plant);
    plant.advance_reference(kInterval);
  }
  servo.reset();
}

}  // namespace
}  // namespace ftcs
