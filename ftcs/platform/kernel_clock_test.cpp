// SPDX-License-Identifier: MIT
// World: a kernel with CLOCK_REALTIME on the oscillator of CLOCK_MONOTONIC_RAW and a PTP hardware
// clock on its own, 40 ppm fast; reading the latter takes 0.8 us over the bus.
#include "ftcs/platform/kernel_clock.h"

#include <gtest/gtest.h>

#include "test/support/fake_clocks.h"

namespace ftcs::platform {
namespace {

constexpr double kMillisecond = 1e6;
constexpr double kSecond = 1e9;

enum class Kind { kSystem, kPhc };

ServoCommand hold(double ppm) {
  return {Rate::from_ppm(ppm), Duration{}, Rate::from_ppm(ppm), Duration{}};
}
ServoCommand correct(double ppm, double ns, double then_ppm) {
  return {Rate::from_ppm(ppm), Duration::from_ns(ns), Rate::from_ppm(then_ppm), Duration{}};
}
ServoCommand step(double ns) { return {Rate{}, Duration{}, Rate{}, Duration::from_ns(ns)}; }

class KernelClockTest : public testing::TestWithParam<Kind> {
 protected:
  KernelClockTest() { kernel.phc.oscillator = 1.0 + 40e-6; }

  [[nodiscard]] KernelClock make(bool may_steer = true) {
    auto device = GetParam() == Kind::kSystem
                      ? ClockDevice::open_system(kernel, ClockAccess::kSteer)
                      : ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
    EXPECT_TRUE(device.ok());
    return KernelClock(std::move(*device), {}, may_steer);
  }
  [[nodiscard]] FakeClocks::Clock& truth() {
    return GetParam() == Kind::kSystem ? kernel.system : kernel.phc;
  }
  /// What the oscillator alone would have made of the ideal time that has passed.
  [[nodiscard]] double free_elapsed(double ideal_ns) { return ideal_ns * truth().oscillator; }
  /// Sleeps as an event loop does.
  void sleep(KernelClock& clock, double ns) {
    const double until = kernel.ideal_ns + ns;
    while (kernel.ideal_ns < until) {
      double wait = until - kernel.ideal_ns;
      if (const auto due = clock.wait_for_expiry_ns()) {
        wait = std::min(wait, static_cast<double>(*due) + 50.0);
      }
      kernel.run(wait);
      (void)clock.read();
    }
  }

  FakeClocks kernel;
};

INSTANTIATE_TEST_SUITE_P(Both, KernelClockTest, testing::Values(Kind::kSystem, Kind::kPhc),
                         [](const testing::TestParamInfo<Kind>& kind) {
                           return kind.param == Kind::kSystem ? "system" : "phc";
                         });

TEST_P(KernelClockTest, is_not_touched_before_the_first_command) {
  KernelClock clock = make();
  for (int i = 0; i < 100; ++i) {
    kernel.run(10 * kMillisecond);
    (void)clock.read();
    (void)clock.from_stamp(FakeClocks::kEpoch + std::llround(truth().time_ns));
    (void)clock.take_foreign_steering();
    clock.settle();
  }
  EXPECT_EQ(kernel.commands, 0);
}

TEST_P(KernelClockTest, runs_at_the_commanded_rate) {
  KernelClock clock = make();
  for (const double ppm : {12.5, -431.0, 5'000.0, -30'000.0}) {
    ASSERT_TRUE(clock.apply(hold(ppm)).ok());
    EXPECT_NEAR(truth().steering(), 1.0 + ppm * 1e-6, 2e-11) << ppm;
  }
}

TEST_P(KernelClockTest, rebuilds_the_free_running_face_from_what_it_commanded) {
  KernelClock clock = make();
  const ClockReading start = clock.read();
  const double began = kernel.ideal_ns;
  const std::array commands{hold(100.0), correct(30'000.0, 20 * kMillisecond, -50.0),
                            correct(-9'000.0, 40 * kMillisecond, 12.0), step(-3 * kSecond),
                            hold(-400.0)};
  for (int round = 0; round < 20; ++round) {
    for (const ServoCommand& command : commands) {
      ASSERT_TRUE(clock.apply(command).ok());
      sleep(clock, 125 * kMillisecond);
    }
  }
  const ClockReading now = clock.read();
  const double free = (now.free_running - start.free_running).ns();
  // 200 changes of the rate, each placed within a bus access; the last look itself takes 0.8 us.
  EXPECT_NEAR(free, free_elapsed(kernel.ideal_ns - began),
              GetParam() == Kind::kPhc ? 1500.0 : 100.0);
  EXPECT_NEAR(now.local.since_epoch().ns(),
              truth().time_ns + static_cast<double>(FakeClocks::kEpoch), 1500.0);
  EXPECT_FALSE(clock.take_foreign_steering().step.has_value());
  EXPECT_FALSE(clock.take_foreign_steering().found_rate.has_value());
}

TEST_P(KernelClockTest, converts_a_stamp_of_before_the_last_commands) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(20'000.0, 50 * kMillisecond, 0.0)).ok());
  sleep(clock, 10 * kMillisecond);
  const ClockReading then = clock.read();
  const std::int64_t stamp = FakeClocks::kEpoch + std::llround(truth().time_ns);
  const double taken = kernel.ideal_ns;
  ASSERT_TRUE(clock.apply(correct(-20'000.0, 5 * kMillisecond, 300.0)).ok());
  sleep(clock, 30 * kMillisecond);
  ASSERT_TRUE(clock.apply(step(kSecond)).ok());
  const auto converted = clock.from_stamp(stamp);
  ASSERT_TRUE(converted.has_value());
  const double since = (*converted - then.free_running).ns();
  EXPECT_NEAR(since, 0.0, 1000.0);
  const double elapsed = free_elapsed(kernel.ideal_ns - taken);  // before: a reading takes time
  const ClockReading now = clock.read();
  EXPECT_NEAR((now.free_running - *converted).ns(), elapsed,
              GetParam() == Kind::kPhc ? 1500.0 : 100.0);
}

TEST_P(KernelClockTest, ends_a_correction_by_itself_and_the_offset_is_gone) {
  for (const double pull : {20'000.0, -20'000.0}) {
    KernelClock clock = make();
    const double began = kernel.ideal_ns;
    const double from = truth().time_ns;
    ASSERT_TRUE(clock.apply(correct(pull, 100 * kMillisecond, 0.0)).ok());
    sleep(clock, 250 * kMillisecond);
    EXPECT_FALSE(clock.expiry().has_value());
    EXPECT_DOUBLE_EQ(truth().steering(), 1.0);
    const double gained = truth().time_ns - from - free_elapsed(kernel.ideal_ns - began);
    EXPECT_NEAR(gained, pull * 1e-6 * 100 * kMillisecond, 250.0) << "at " << pull;
    kernel.held_names.clear();
  }
}

TEST_P(KernelClockTest, never_sleeps_beyond_the_end_of_a_correction_even_where_sleep_is_steered) {
  KernelClock clock = make();
  for (const double pull : {30'000.0, -30'000.0}) {
    ASSERT_TRUE(clock.apply(correct(pull, 100 * kMillisecond, 0.0)).ok());
    (void)clock.read();
    const double wait = static_cast<double>(*clock.wait_for_expiry_ns());
    const double left = (*clock.expiry() - clock.read().free_running).ns();
    EXPECT_LE(wait / (1.0 + pull * 1e-6), left + 2000.0);
    EXPECT_LE(wait, left + 2000.0);
    EXPECT_GT(wait, 0.9 * left);
    clock.settle();
  }
}

TEST_P(KernelClockTest, settles_on_the_tracking_rate) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(20'000.0, kSecond, 33.0)).ok());
  clock.settle();
  EXPECT_NEAR(truth().steering(), 1.0 + 33e-6, 2e-11);
}

TEST_P(KernelClockTest, a_lost_device_is_an_error_and_readings_stand_still) {
  if (GetParam() == Kind::kSystem) GTEST_SKIP() << "CLOCK_REALTIME cannot be unplugged";
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(100.0, kSecond, 0.0)).ok());
  const ClockReading last = clock.read();
  kernel.phc_gone = true;
  kernel.run(2 * kSecond);
  EXPECT_EQ(clock.read().local, last.local);
  EXPECT_EQ(clock.failure(), ClockError::kGone);
  const auto applied = clock.apply(hold(1.0));
  ASSERT_FALSE(applied.ok());
  EXPECT_EQ(applied.error(), ClockError::kGone);
  EXPECT_FALSE(clock.wait_for_expiry_ns().has_value());
  clock.settle();
}

TEST_P(KernelClockTest, a_refused_command_changes_nothing) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(hold(5.0)).ok());
  const struct {
    int number;
    ClockError error;
  } kCases[] = {{EPERM, ClockError::kNotPermitted},
                {EACCES, ClockError::kNotPermitted},
                {EBUSY, ClockError::kBusy},
                {ENODEV, ClockError::kGone}};
  for (const auto& expected : kCases) {
    const double before = truth().steering();
    kernel.adjust_errno = expected.number;
    const auto applied = clock.apply(hold(77.0));
    ASSERT_FALSE(applied.ok());
    EXPECT_EQ(applied.error(), expected.error);
    EXPECT_DOUBLE_EQ(truth().steering(), before);
    kernel.adjust_errno = 0;
    if (expected.error != ClockError::kGone) {
      EXPECT_TRUE(clock.apply(hold(5.0)).ok()) << "it may work again";
    }
  }
}

TEST_P(KernelClockTest, a_correction_whose_end_was_refused_is_ended_later) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(1'000.0, 10 * kMillisecond, 0.0)).ok());
  kernel.adjust_errno = EBUSY;
  kernel.run(20 * kMillisecond);
  (void)clock.read();
  EXPECT_TRUE(clock.expiry().has_value());
  EXPECT_GT(*clock.wait_for_expiry_ns(), 1'000'000) << "a kernel that refuses is not hammered";
  kernel.adjust_errno = 0;
  kernel.run(20 * kMillisecond);
  (void)clock.read();
  EXPECT_FALSE(clock.expiry().has_value());
  EXPECT_DOUBLE_EQ(truth().steering(), 1.0);
}

TEST_P(KernelClockTest, a_correction_that_may_not_be_ended_is_a_failure) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(1'000.0, 10 * kMillisecond, 0.0)).ok());
  kernel.adjust_errno = EPERM;
  kernel.run(20 * kMillisecond);
  (void)clock.read();
  ASSERT_TRUE(clock.failure().has_value());
  EXPECT_EQ(*clock.failure(), ClockError::kNotPermitted);
}

TEST_P(KernelClockTest, refuses_rates_beyond_the_device_and_everything_if_it_may_not_steer) {
  {
    KernelClock clock = make();
    const auto applied = clock.apply(hold(GetParam() == Kind::kPhc ? 50'001.0 : 100'001.0));
    ASSERT_FALSE(applied.ok());
    EXPECT_EQ(applied.error(), ClockError::kRateOutOfLimits);
    kernel.held_names.clear();
  }
  KernelClock clock = make(false);
  EXPECT_FALSE(clock.apply(hold(1.0)).ok());
  EXPECT_TRUE(clock.leap_now(1).has_value());
  EXPECT_EQ(kernel.commands, 0);
}

TEST_P(KernelClockTest, reports_a_frequency_that_somebody_else_set) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(hold(10.0)).ok());
  kernel.run(100 * kMillisecond);
  EXPECT_FALSE(clock.take_foreign_steering().found_rate.has_value());
  truth().freq = 65'536 * 25;
  kernel.run(100 * kMillisecond);
  const ForeignSteering foreign = clock.take_foreign_steering();
  ASSERT_TRUE(foreign.found_rate.has_value());
  EXPECT_NEAR(foreign.found_rate->ppm(), 25.0, 1e-4);
  EXPECT_NEAR(foreign.expected_rate->ppm(), 10.0, 1e-4);
  EXPECT_FALSE(clock.take_foreign_steering().found_rate.has_value()) << "once";
  EXPECT_EQ(clock.foreign_rates(), 1U);
}

TEST_P(KernelClockTest, the_end_of_a_correction_does_not_hide_that_somebody_changed_the_frequency) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(100.0, 20 * kMillisecond, 10.0)).ok());
  truth().freq = static_cast<long>(25.0 * 65536.0);
  sleep(clock, 30 * kMillisecond);
  EXPECT_NEAR(truth().steering(), 1.0 + 10e-6, 2e-11) << "the correction has ended";
  const ForeignSteering foreign = clock.take_foreign_steering();
  ASSERT_TRUE(foreign.found_rate.has_value());
  EXPECT_NEAR(foreign.found_rate->ppm(), 25.0, 1e-4);
  EXPECT_NEAR(foreign.expected_rate->ppm(), 100.0, 1e-4);
}

TEST_P(KernelClockTest, survives_a_step_by_somebody_else) {
  for (const double leap_ns : {0.5 * kSecond, -0.5 * kSecond}) {
    KernelClock clock = make();
    ASSERT_TRUE(clock.apply(hold(10.0)).ok());
    const ClockReading start = clock.read();
    const double began = kernel.ideal_ns;
    kernel.run(50 * kMillisecond);
    const std::int64_t before = FakeClocks::kEpoch + std::llround(truth().time_ns);
    kernel.run(50 * kMillisecond);
    truth().time_ns += leap_ns;
    const std::int64_t unnoticed = FakeClocks::kEpoch + std::llround(truth().time_ns);
    kernel.run(kMillisecond);
    // Nobody knows when it was stepped: stamps from before the discovery cannot be placed.
    EXPECT_FALSE(clock.from_stamp(leap_ns > 0.0 ? unnoticed : before).has_value());
    const ForeignSteering foreign = clock.take_foreign_steering();
    ASSERT_TRUE(foreign.step.has_value());
    EXPECT_NEAR(foreign.step->ns(), leap_ns, 20'000.0);
    EXPECT_EQ(clock.foreign_steps(), 1U);
    kernel.run(kMillisecond);
    const auto stamp = clock.from_stamp(FakeClocks::kEpoch + std::llround(truth().time_ns));
    ASSERT_TRUE(stamp.has_value());
    // A hardware clock is bridged by another oscillator, 40 ppm of 100 ms.
    EXPECT_NEAR((*stamp - start.free_running).ns(), free_elapsed(kernel.ideal_ns - began),
                10'000.0);
    kernel.held_names.clear();
  }
}

// CLOCK_MONOTONIC_RAW stood still, the adapter did not; how long the machine slept it knows by a
// calendar clock of whole seconds.
TEST(KernelClock, a_hardware_clock_that_went_on_while_the_machine_slept_was_stepped_by_nobody) {
  FakeClocks kernel;
  auto device = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
  KernelClock clock(std::move(*device));
  ASSERT_TRUE(clock.apply(hold(10.0)).ok());
  const ClockReading start = clock.read();
  const double began = kernel.phc.time_ns;
  kernel.run(50 * kMillisecond);
  kernel.slept_ns += 2'000'000'000;
  kernel.phc.advance(2.7 * kSecond);
  kernel.run(50 * kMillisecond);
  EXPECT_FALSE(clock.take_foreign_steering().step.has_value());
  EXPECT_EQ(clock.foreign_steps(), 0U);
  const ClockReading now = clock.read();
  EXPECT_NEAR((now.local - start.local).ns(), kernel.phc.time_ns - began, 2'000.0);
  EXPECT_NEAR((now.free_running - start.free_running).ns(),
              (kernel.phc.time_ns - began) / (1.0 + 10e-6), 2'000.0);
  // And somebody's step afterwards is one.
  kernel.run(50 * kMillisecond);
  kernel.phc.time_ns += 0.5 * kSecond;
  EXPECT_TRUE(clock.take_foreign_steering().step.has_value());
}

TEST(KernelClock, takes_the_announced_leap_of_the_kernel_and_local_time_goes_on) {
  for (const int leap : {1, -1}) {
    FakeClocks kernel;
    auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
    KernelClock clock(std::move(*device));
    clock.set_timescale_offset(Nanoseconds{std::chrono::seconds{37}});
    ASSERT_TRUE(clock.apply(hold(0.0)).ok());
    clock.expect_leap(leap);
    const ClockReading before = clock.read();
    const double began = kernel.ideal_ns;
    kernel.run(kSecond);
    kernel.system.time_ns -= leap * kSecond;
    const ClockReading after = clock.read();
    EXPECT_NEAR((after.local - before.local).ns(), kernel.ideal_ns - began, 200.0);
    EXPECT_EQ(clock.timescale_offset(), Duration{Nanoseconds{std::chrono::seconds{37 + leap}}});
    const ForeignSteering seen = clock.take_foreign_steering();
    EXPECT_EQ(seen.leap, leap);
    EXPECT_FALSE(seen.step.has_value());
  }
}

TEST(KernelClock, makes_the_leap_itself_where_the_kernel_does_not) {
  FakeClocks kernel;
  auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
  KernelClock clock(std::move(*device));
  const ClockReading before = clock.read();
  const double utc = kernel.system.time_ns;
  const double began = kernel.ideal_ns;
  ASSERT_FALSE(clock.leap_now(1).has_value());
  const ClockReading after = clock.read();
  EXPECT_NEAR((after.local - before.local).ns(), kernel.ideal_ns - began, 200.0);
  EXPECT_NEAR(kernel.system.time_ns - utc, -kSecond, 2000.0);
  EXPECT_FALSE(clock.take_foreign_steering().step.has_value());
}

TEST(KernelClock, shows_what_was_commanded_where_the_kernel_runs_by_multiples) {
  FakeClocks kernel;
  kernel.system.multiplier_unit = 119e-9;
  auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
  KernelClock clock(std::move(*device));
  ASSERT_TRUE(clock.apply(hold(20.05)).ok());
  const ClockReading start = clock.read();
  double farthest = 0.0;
  for (int i = 0; i < 1'000; ++i) {
    (void)kernel.poll({}, 125);
    const std::int64_t stamp = FakeClocks::kEpoch + std::llround(kernel.system.time_ns);
    const double raw = kernel.raw;
    const auto instant = clock.from_stamp(stamp);
    ASSERT_TRUE(instant.has_value());
    EXPECT_NEAR((*instant - FreeRunningTime::from_ns(std::llround(raw))).ns(), 0.0, 2.0)
        << "a stamp is what the clock showed";
    const ClockReading now = clock.read();
    const double commanded = (now.free_running - start.free_running).ns() * (1.0 + 20.05e-6);
    EXPECT_NEAR((now.local - start.local).ns(), commanded, 10.0);
    const LocalTime shown = clock.local_of(stamp);
    farthest = std::max(farthest, std::abs((shown - clock.local_at(*instant)).ns()));
  }
  EXPECT_GT(farthest, 5.0) << "or there was nothing to show";
  EXPECT_LT(farthest, 20.0);
}

TEST(KernelClock, learns_what_the_kernel_makes_of_a_rate) {
  FakeClocks kernel;
  auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
  KernelClock clock(std::move(*device));
  constexpr double kGain = 3e-6;  // the multiplier's rounding: real time runs faster than asked
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(clock.apply(hold(20.0)).ok());
    kernel.run(kSecond);
    kernel.system.time_ns += kGain * kSecond;
  }
  EXPECT_NEAR(kernel.system.steering() * (1.0 + kGain), 1.0 + 20e-6, 1e-8);
  EXPECT_FALSE(clock.take_foreign_steering().found_rate.has_value());
}

}  // namespace
}  // namespace ftcs::platform
