// SPDX-License-Identifier: MIT
// World: a machine whose system clock is right, and a reference that shows another date: a
// transmitter with stamps of either clock, or an adapter's clock that was never set.
#include <cmath>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/phc/phc_runner.h"
#include "ftcs/daemon/ptp_port.h"
#include "ftcs/ptp/wire/codec.h"
#include "test/support/fake_clocks.h"
#include "test/support/fake_network.h"

namespace ftcs::daemon {
namespace {

using platform::FakeClocks;

constexpr double k1970 = -static_cast<double>(FakeClocks::kEpoch) + 100 * kSecond;
constexpr std::int64_t kBuilt = FakeClocks::kEpoch / 1'000'000'000 - 86'400;

class WrongEpoch : public testing::Test {
 protected:
  WrongEpoch() {
    kernel.add_adapter_clock();
    kernel.phc.time_ns = kTai;
    ptp.interface = ptp.socket.interface = "eth0";
    ptp.management.socket.clear();
    ptp.duration = phc.duration = Duration::from_ns(30 * kSecond);
    ptp.log_level = 5;
    ptp.follower.epoch.earliest_utc_s = phc.epoch.earliest_utc_s = kBuilt;
    phc.source = "/dev/ptp0";
    phc.sink_ahead_s = -37;
  }
  void choose(ClockKind clock) {
    ptp.clock.kind = clock;
    ptp.timestamps = clock == ClockKind::kSystem ? platform::TimestampMode::kSoftware
                                                 : platform::TimestampMode::kHardware;
  }
  int follow_network() {
    return captured([&] { return run_ptp(kernel, ptp); });
  }
  int follow_clock() {
    return captured([&] { return run_phc(kernel, phc, log); });
  }
  template <class Run>
  int captured(Run run) {
    const double start = kernel.ideal_ns;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = run();
    said = testing::internal::GetCapturedStdout();
    errors = testing::internal::GetCapturedStderr();
    kernel.held_names.clear();
    lasted_s = (kernel.ideal_ns - start) / kSecond;
    return code;
  }
  void expect_refused(int code, const char* reason) {
    EXPECT_EQ(code, kRuntimeError);
    EXPECT_EQ(kernel.commands, 0) << "no clock was touched";
    EXPECT_LT(lasted_s, 16.0);
    EXPECT_NE(errors.find(reason), std::string::npos) << errors;
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  }

  NetworkKernel kernel;
  Log log{kernel, stdout, 5};
  PtpOptions ptp;
  PhcOptions phc;
  std::string said;
  std::string errors;
  double lasted_s = 0.0;
};

TEST_F(WrongEpoch, a_transmitter_at_1970_moves_neither_clock) {
  for (const ClockKind clock : {ClockKind::kSystem, ClockKind::kPhc}) {
    for (const ServoKind servo : {ServoKind::kAdaptive, ServoKind::kLinuxptpPi}) {
      choose(clock);
      ptp.follower.servo.kind = servo;
      ptp.follower.first_step = servo == ServoKind::kAdaptive;
      kernel.reference_ahead = k1970;
      expect_refused(follow_network(), "the reference shows 1970-01-01");
    }
  }
}

TEST_F(WrongEpoch, a_transmitter_of_an_arbitrary_timescale_moves_neither_clock) {
  for (const ClockKind clock : {ClockKind::kSystem, ClockKind::kPhc}) {
    choose(clock);
    kernel.flags = 0;
    expect_refused(follow_network(), "arbitrary timescale");
  }
}

TEST_F(WrongEpoch, an_adapters_clock_that_was_never_set_moves_neither_clock) {
  for (const char* sink : {"CLOCK_REALTIME", "/dev/ptp1"}) {
    kernel.phc.time_ns = k1970;
    phc.sink = sink;
    phc.sink_ahead_s = sink == std::string("/dev/ptp1") ? 0 : -37;
    expect_refused(follow_clock(), "the reference shows 1970-01-01");
  }
}

TEST_F(WrongEpoch, a_system_clock_that_was_never_set_moves_no_adapters_clock) {
  kernel.system.time_ns = k1970;
  phc.source = "CLOCK_REALTIME";
  phc.sink = "/dev/ptp0";
  expect_refused(follow_clock(), "the reference shows 1970-01-01");
}

TEST_F(WrongEpoch, a_date_two_days_away_moves_no_clock) {
  constexpr double kTwoDays = 2 * 86'400 * kSecond;
  choose(ClockKind::kSystem);
  ptp.follower.first_step = true;
  kernel.reference_ahead = kTai + kTwoDays;
  expect_refused(follow_network(), "from the system clock");
  kernel.phc.time_ns = kTai + kTwoDays;
  expect_refused(follow_clock(), "from the system clock");
}

TEST_F(WrongEpoch, what_was_asked_for_is_followed) {
  choose(ClockKind::kPhc);
  ptp.follower.epoch.any_epoch = true;
  ptp.follower.first_step = true;
  kernel.flags = 0;
  kernel.reference_ahead = k1970;
  EXPECT_EQ(follow_network(), kSuccess) << errors;
  EXPECT_NEAR(kernel.phc.time_ns - kernel.ideal_ns, k1970, 1e5);
}

TEST_F(WrongEpoch, a_plausible_reference_is_followed) {
  for (const ClockKind clock : {ClockKind::kSystem, ClockKind::kPhc}) {
    choose(clock);
    EXPECT_EQ(follow_network(), kSuccess) << errors;
    EXPECT_NEAR(kernel.phc.time_ns - kernel.ideal_ns, kTai, 1'000.0);
    EXPECT_NEAR(kernel.system.time_ns - kernel.ideal_ns, 0.0, 1'000.0);
  }
  EXPECT_EQ(follow_clock(), kSuccess) << errors;
}

// A board without a battery: its clock starts in 1970, and the reference is there to set it.
TEST_F(WrongEpoch, a_system_clock_that_starts_in_1970_is_set) {
  choose(ClockKind::kSystem);
  ptp.follower.first_step = true;
  kernel.system.time_ns = k1970;
  EXPECT_EQ(follow_network(), kSuccess) << errors;
  EXPECT_NEAR(kernel.system.time_ns - kernel.ideal_ns, 0.0, 1'000.0);
}

// The grandmaster loses its mind, or another one takes over.
TEST_F(WrongEpoch, a_wrong_date_in_mid_run_is_not_followed_and_left_when_it_is_gone) {
  for (const bool to_system : {true, false}) {
    choose(to_system ? ClockKind::kSystem : ClockKind::kPhc);
    ptp.follower.servo.kind = ServoKind::kLinuxptpPi;
    ptp.follower.step_threshold = Nanoseconds{1'000};  // even if it may step at any time
    ptp.duration = Duration::from_ns(60 * kSecond);
    const double start = kernel.ideal_ns;
    double largest = 0.0;
    kernel.on_second = [&] {
      const double s = (kernel.ideal_ns - start) / kSecond;
      kernel.reference_ahead = s > 20.0 && s < 30.0 ? k1970 : kTai;
      const FakeClocks::Clock& clock = to_system ? kernel.system : kernel.phc;
      const double error = clock.time_ns - kernel.ideal_ns - (to_system ? 0.0 : kTai);
      if (s > 15.0) largest = std::max(largest, std::abs(error));
    };
    EXPECT_EQ(follow_network(), kSuccess) << errors;
    EXPECT_LT(largest, 2'000.0);
  }
}

// With one limit lifted the next would be met: the line says both.
TEST_F(WrongEpoch, a_jump_that_two_limits_refuse_names_the_flags_of_both) {
  for (const bool first_step : {false, true}) {
    choose(ClockKind::kPhc);
    ptp.follower.first_step = first_step;
    kernel.reference_ahead = kTai;
    ptp.duration = Duration::from_ns(40 * kSecond);
    const double start = kernel.ideal_ns;
    kernel.on_second = [&] {
      if (kernel.ideal_ns - start > 20 * kSecond) kernel.reference_ahead = kTai + 5'000 * kSecond;
    };
    (void)follow_network();
    EXPECT_NE(said.find("not followed (--max-change)"), std::string::npos) << said;
    EXPECT_EQ(said.find("(--max-change), and more than 1 s is refused (--first-step") !=
                  std::string::npos,
              !first_step)
        << said;
  }
}

// What it was asleep for is no jump of the reference.
TEST_F(WrongEpoch, a_machine_that_slept_follows_again) {
  bool slept = false;
  constexpr std::int64_t kHour = 3'600'000'000'000;
  kernel.on_poll = [&] {
    if (slept || kernel.ideal_ns < 10 * kSecond) return;
    slept = true;
    kernel.slept_ns = kHour;
    kernel.ideal_ns += static_cast<double>(kHour);
    kernel.phc.time_ns += static_cast<double>(kHour);
    kernel.system.time_ns += static_cast<double>(kHour) + 0.2 * kSecond;  // by a coarse RTC
  };
  phc.duration = Duration::from_ns(120 * kSecond);
  phc.servo.limits = RateLimits::symmetric_ppb(100e6);  // else 0.2 s take seven minutes
  EXPECT_EQ(follow_clock(), kSuccess) << errors;
  EXPECT_TRUE(slept);
  EXPECT_NEAR(kernel.system.time_ns - kernel.ideal_ns, 0.0, 1'000.0);
}

// An adapter's clock goes on meanwhile.
TEST_F(WrongEpoch, a_machine_that_slept_follows_by_an_adapters_clock_as_before) {
  choose(ClockKind::kPhc);
  ptp.follower.first_step = true;
  kernel.reference_ahead = kTai + 0.5 * kSecond;
  ptp.duration = Duration::from_ns(60 * kSecond);
  constexpr std::int64_t kMinute = 60'000'000'000;
  const double start = kernel.ideal_ns;
  kernel.on_second = [&] {
    if (kernel.slept_ns > 0 || kernel.ideal_ns - start < 20 * kSecond) return;
    kernel.slept_ns = kMinute;
    const double truly = static_cast<double>(kMinute) + 0.4 * kSecond;
    kernel.ideal_ns += truly;
    kernel.phc.advance(truly);
    kernel.system.time_ns += static_cast<double>(kMinute);
  };
  EXPECT_EQ(follow_network(), kSuccess) << said << errors;
  EXPECT_GT(kernel.slept_ns, 0);
  EXPECT_EQ(said.find("another program"), std::string::npos) << said;
  EXPECT_EQ(said.find("not followed"), std::string::npos) << said;
  EXPECT_NEAR(kernel.phc.time_ns - kernel.ideal_ns, kernel.reference_ahead, 1'000.0);
}

}  // namespace
}  // namespace ftcs::daemon
