// SPDX-License-Identifier: MIT
// World: CLOCK_REALTIME of a fake kernel, 30 s before a UTC midnight, followed by a TAI reference
// that announces its timescale once a second.
#include "ftcs/daemon/real_clock.h"

#include <memory>

#include <gtest/gtest.h>

#include "test/support/fake_clocks.h"

namespace ftcs::daemon {
namespace {

using platform::ClockAccess;
using platform::ClockDevice;
using platform::FakeClocks;
using platform::KernelClock;

constexpr double kSecond = 1e9;
constexpr std::int64_t kNewYear2024 = 1'704'067'200;  // the day before ends a month
constexpr std::int64_t kJanuary2nd2024 = kNewYear2024 + 86'400;

class RealClockTest : public testing::Test {
 protected:
  void start(std::int64_t midnight, bool kernel_leap = true) {
    kernel.system.time_ns =
        static_cast<double>(midnight * 1'000'000'000 - FakeClocks::kEpoch) - 30 * kSecond;
    UtcConfig utc;
    utc.kernel_leap = kernel_leap;
    auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
    real = std::make_unique<RealClock>(kernel, log, KernelClock(std::move(*device)), utc);
  }
  void steer() { ASSERT_TRUE(real->clock().apply({Rate{}, Duration{}, Rate{}, Duration{}}).ok()); }
  void announce(const ReferenceScale& scale) {
    announced = scale;
    real->set_reference_scale(scale);
  }
  /// Runs the loop for some seconds; the kernel leaps at midnight if it was asked to.
  void run(int seconds, std::int64_t midnight) {
    for (int i = 0; i < 10 * seconds; ++i) {
      if (i % 10 == 9) real->set_reference_scale(announced);
      kernel.run(0.1 * kSecond);
      const double since = kernel.system.time_ns -
                           static_cast<double>(midnight * 1'000'000'000 - FakeClocks::kEpoch);
      if (since >= 0.0 && (kernel.system.status & STA_INS) != 0 && !leapt) {
        kernel.system.time_ns -= kSecond;
        leapt = true;
      }
      if (since >= -kSecond && (kernel.system.status & STA_DEL) != 0 && !leapt) {
        kernel.system.time_ns += kSecond;
        leapt = true;
      }
      EXPECT_FALSE(real->attend(true, true, {}).has_value());
    }
  }
  /// How much less UTC than TAI has passed.
  [[nodiscard]] double lost_seconds(double ideal_start, double utc_start) const {
    return ((kernel.ideal_ns - ideal_start) - (kernel.system.time_ns - utc_start)) / kSecond;
  }

  FakeClocks kernel;
  Log log{kernel, stdout, 3};
  std::unique_ptr<RealClock> real;
  ReferenceScale announced{};
  bool leapt = false;
};

TEST_F(RealClockTest, leaves_a_rate_behind_that_was_set_while_the_servo_was_locked) {
  struct Case {
    bool was_locked;
    double expected_ppm;
  };
  for (const auto& [was_locked, expected_ppm] : {Case{true, 20.0}, Case{false, 7.0}}) {
    kernel.system.freq = 7 * 65'536;
    kernel.held_names.clear();
    start(kNewYear2024);
    const auto command = [&](double ppm, bool locked) {
      const Rate rate = Rate::from_ppm(ppm);
      ASSERT_TRUE(real->clock().apply({rate, Duration{}, rate, Duration{}}).ok());
      EXPECT_FALSE(real->attend(true, locked, {}).has_value());
    };
    command(20.0, was_locked);
    command(6'027.0, false);
    real->stop();
    EXPECT_NEAR(kernel.system.steering(), 1.0 + expected_ppm * 1e-6, 2e-11);
  }
}

TEST_F(RealClockTest, local_time_is_tai_by_the_offset_of_the_reference) {
  start(kNewYear2024);
  announce({.tai = true, .utc_offset = 37});
  const double utc_ns = kernel.system.time_ns;
  EXPECT_NEAR(
      (real->clock().read().local.since_epoch() - Duration::from_whole_ns(FakeClocks::kEpoch)).ns(),
      utc_ns + 37 * kSecond, 1e4);
}

TEST_F(RealClockTest, an_arbitrary_timescale_is_taken_as_it_stands_if_that_is_asked_for) {
  for (const bool allowed : {true, false}) {
    kernel.held_names.clear();
    UtcConfig utc;
    utc.epoch.any_epoch = allowed;
    auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
    real = std::make_unique<RealClock>(kernel, log, KernelClock(std::move(*device)), utc);
    announce({.tai = false, .utc_offset = 37});
    EXPECT_EQ(real->clock().timescale_offset(), Duration{});
    const ClockReading now = real->clock().read();
    EXPECT_EQ(real->admits(ReferenceTime{now.local.since_epoch()}, now.free_running), allowed);
    EXPECT_EQ(real->refusal().has_value(), !allowed);
    real.reset();
  }
}

TEST_F(RealClockTest, a_leap_of_the_kernel_leaves_local_time_alone) {
  for (const int leap : {1, -1}) {
    for (const bool kernel_leap : {true, false}) {
      kernel.held_names.clear();
      leapt = false;
      start(kNewYear2024, kernel_leap);
      announce({.tai = true, .utc_offset = 37, .leap = leap});
      steer();
      const double ideal = kernel.ideal_ns;
      const double utc = kernel.system.time_ns;
      const ClockReading before = real->clock().read();
      run(40, kNewYear2024);
      EXPECT_EQ(leapt, kernel_leap);
      EXPECT_NEAR(lost_seconds(ideal, utc), leap, 1e-3);
      EXPECT_NEAR((real->clock().read().local - before.local).ns(), kernel.ideal_ns - ideal, 1e4);
      EXPECT_EQ(real->clock().timescale_offset(),
                Duration{Nanoseconds{std::chrono::seconds{37 + leap}}});
      EXPECT_EQ(kernel.system.tai, 37 + leap);
      EXPECT_EQ(kernel.system.status & (STA_INS | STA_DEL), 0) << "nothing stays armed";
      // The reference says so a little later, and nothing more happens.
      announce({.tai = true, .utc_offset = 37 + leap});
      EXPECT_NEAR(lost_seconds(ideal, utc), leap, 1e-3);
    }
  }
}

TEST_F(RealClockTest, a_reference_that_is_ahead_of_the_leap_does_not_undo_it) {
  start(kNewYear2024);
  announce({.tai = true, .utc_offset = 37, .leap = 1});
  steer();
  run(25, kNewYear2024);
  ASSERT_NE(kernel.system.status & STA_INS, 0);
  announce({.tai = true, .utc_offset = 38});  // its midnight was a little earlier
  EXPECT_EQ(real->clock().timescale_offset(), Duration{Nanoseconds{std::chrono::seconds{37}}});
  run(40, kNewYear2024);
  EXPECT_TRUE(leapt) << "it stays armed";
  EXPECT_EQ(real->clock().timescale_offset(), Duration{Nanoseconds{std::chrono::seconds{38}}});
  EXPECT_EQ(kernel.system.tai, 38);
  EXPECT_FALSE(real->take_scale_change());
}

TEST_F(RealClockTest, a_reference_that_is_behind_the_leap_does_not_undo_it) {
  start(kNewYear2024);
  announce({.tai = true, .utc_offset = 37, .leap = 1});
  steer();
  run(40, kNewYear2024);
  ASSERT_TRUE(leapt);
  announce({.tai = true, .utc_offset = 37, .leap = 1});
  run(5, kNewYear2024);
  EXPECT_EQ(real->clock().timescale_offset(), Duration{Nanoseconds{std::chrono::seconds{38}}});
  // One that insists is believed in the end, and the servo is told.
  announce({.tai = true, .utc_offset = 37});
  run(120, kNewYear2024);
  EXPECT_EQ(real->clock().timescale_offset(), Duration{Nanoseconds{std::chrono::seconds{37}}});
  EXPECT_TRUE(real->take_scale_change());
}

TEST_F(RealClockTest, a_leap_is_kept_where_the_reference_does_not_vouch_for_its_offset) {
  start(kNewYear2024);
  announce({.tai = true, .leap = 1});
  steer();
  run(40, kNewYear2024);
  ASSERT_TRUE(leapt);
  announce({.tai = true});
  run(120, kNewYear2024);
  EXPECT_EQ(real->clock().timescale_offset(), Duration{Nanoseconds{std::chrono::seconds{38}}});
}

TEST_F(RealClockTest, a_leap_flag_on_a_day_without_leap_seconds_is_not_believed) {
  start(kJanuary2nd2024);
  announce({.tai = true, .utc_offset = 37, .leap = 1});
  steer();
  run(40, kJanuary2nd2024);
  EXPECT_FALSE(leapt);
  EXPECT_EQ(real->clock().timescale_offset(), Duration{Nanoseconds{std::chrono::seconds{37}}});
}

TEST_F(RealClockTest, the_kernel_is_told_only_once_the_clock_is_steered) {
  start(kNewYear2024);
  announce({.tai = true, .utc_offset = 37});
  EXPECT_FALSE(real->attend(false, false, {}).has_value());
  EXPECT_EQ(kernel.commands, 0);
  ServoSnapshot servo;
  servo.offset = Nanoseconds{-2'500};
  servo.offset_sigma_ns = 400.0;
  servo.path_delay = Nanoseconds{10'000};
  kernel.run(2 * kSecond);
  EXPECT_FALSE(real->attend(true, true, servo).has_value());
  EXPECT_EQ(kernel.system.status, 0) << "STA_UNSYNC cleared";
  EXPECT_EQ(kernel.system.esterror, 3);
  EXPECT_EQ(kernel.system.maxerror, 14);
  kernel.run(2 * kSecond);
  EXPECT_FALSE(real->attend(true, false, servo).has_value());
  EXPECT_EQ(kernel.system.status, STA_UNSYNC);
}

TEST_F(RealClockTest, an_expired_leap_second_list_is_said_once) {
  for (const std::int64_t days_left : {2, -2}) {
    kernel.held_names.clear();
    std::FILE* const lines = std::tmpfile();
    ASSERT_NE(lines, nullptr);
    Log noted(kernel, lines, 4);
    constexpr std::int64_t kFrom1900 = 2'208'988'800;
    auto list = LeapSeconds::parse(
        fmt::format("#@ {}\n3692217600 37\n", kNewYear2024 + kFrom1900 + days_left * 86'400),
        "list");
    ASSERT_TRUE(list.ok());
    kernel.system.time_ns = static_cast<double>(kNewYear2024 * 1'000'000'000 - FakeClocks::kEpoch);
    auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
    RealClock clock(kernel, noted, KernelClock(std::move(*device)), {.leap_seconds = *list});
    for (int i = 0; i < 10; ++i) {
      kernel.run(kSecond);
      EXPECT_FALSE(clock.attend(true, i > 4, {}).has_value());
    }
    clock.stop();
    std::rewind(lines);
    int warnings = 0;
    for (char line[256]; std::fgets(line, sizeof line, lines) != nullptr;) {
      warnings += std::string(line).find("list has expired") != std::string::npos ? 1 : 0;
    }
    std::fclose(lines);
    EXPECT_EQ(warnings, days_left < 0 ? 1 : 0);
  }
}

// A clock that lost its date stands before a leap second of long ago: the list that tells of it has
// its offset already, and it is not made again.
TEST_F(RealClockTest, a_leap_second_from_before_the_list_was_made_is_over) {
  constexpr std::int64_t kNewYear2017 = 1'483'228'800;
  constexpr const char* kChanges = "3644697600 36\n3692217600 37\n";
  for (const bool later : {true, false}) {
    const std::string made = later ? "#$ 3707596800\n" : "#$ 3676924800\n";  // June 2017, July 2016
    const auto list = LeapSeconds::parse(made + kChanges, "list");
    ASSERT_TRUE(list.ok());
    start(kNewYear2017);
    leapt = false;
    kernel.held_names.clear();
    auto device = ClockDevice::open_system(kernel, ClockAccess::kSteer);
    UtcConfig utc;
    utc.leap_seconds = *list;
    real.reset();
    real = std::make_unique<RealClock>(kernel, log, KernelClock(std::move(*device)), utc);
    real->set_reference_scale({});
    steer();
    run(40, kNewYear2017);
    EXPECT_EQ(leapt, !later);
    EXPECT_EQ(kernel.system.tai, 37);
  }
}

TEST_F(RealClockTest, a_device_that_is_gone_ends_the_run) {
  auto device = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
  RealClock phc(kernel, log, KernelClock(std::move(*device)), {});
  EXPECT_FALSE(phc.attend(true, true, {}).has_value());
  kernel.phc_gone = true;
  kernel.run(2 * kSecond);
  (void)phc.clock().read();
  const auto reason = phc.attend(true, true, {});
  ASSERT_TRUE(reason.has_value());
  EXPECT_EQ(*reason, "/dev/ptp0: the device is gone");
  phc.stop();
}

}  // namespace
}  // namespace ftcs::daemon
