// SPDX-License-Identifier: MIT
// World: an oscillator 20 ppm fast, stamps of whole nanoseconds, no noise; a clock of a process
// that others keep from ending its corrections: each ends 2 to 14 ms late, or as late as a test
// says.
#include "ftcs/discipline/late_expiry.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/discipline/clock_discipline.h"
#include "test/support/manual_source.h"
#include "test/support/watched_clock.h"

namespace ftcs {
namespace {

constexpr double kMillisecond = 1e6;

ServoCommand correction(double pull_ppm, double ms) {
  const Rate tracking = Rate::from_ppm(-20.0);
  return {Rate::from_ratio(tracking.ratio() + pull_ppm * 1e-6),
          Duration::from_ns(ms * kMillisecond), tracking, Duration{}};
}
double removed_ns(const ServoCommand& command) {
  return (command.correction_rate.ratio() - command.tracking_rate.ratio()) *
         command.correction_time.ns();
}

TEST(LateExpiry, leaves_a_correction_that_is_long_beside_the_lateness) {
  const ServoCommand command = correction(50.0, 16.0);
  for (const double late_ms : {0.0, 0.1, 4.0}) {
    const ServoCommand same = stretched(command, Duration::from_ns(late_ms * kMillisecond));
    EXPECT_EQ(same.correction_time, command.correction_time) << late_ms;
    EXPECT_EQ(same.correction_rate, command.correction_rate) << late_ms;
  }
}

TEST(LateExpiry, removes_the_same_offset_over_four_latenesses_and_eight_times_the_time_at_most) {
  const ServoCommand command = correction(50.0, 16.0);
  const ServoCommand longer = stretched(command, Duration::from_ns(10.0 * kMillisecond));
  EXPECT_DOUBLE_EQ(longer.correction_time.ns(), 40.0 * kMillisecond);
  EXPECT_NEAR(removed_ns(longer), removed_ns(command), 1e-6);
  EXPECT_EQ(longer.tracking_rate, command.tracking_rate);
  const ServoCommand longest = stretched(command, Duration::from_ns(3e9));
  EXPECT_DOUBLE_EQ(longest.correction_time.ns(), 128.0 * kMillisecond);
  EXPECT_NEAR(removed_ns(longest), removed_ns(command), 1e-6);
}

TEST(LateExpiry, leaves_a_command_without_a_correction) {
  const ServoCommand hold = correction(0.0, 0.0);
  const ServoCommand same = stretched(hold, Duration::from_ns(3e9));
  EXPECT_EQ(same.correction_time, Duration{});
  EXPECT_EQ(same.correction_rate, hold.correction_rate);
}

// The true error, at most, of the second half of a minute; 1 ms off at first.
double worst_ns(double interval_ns, std::uint64_t seed) {
  constexpr double kDelayNs = 1'000.0;
  test::ManualSource oscillator;
  const auto reading = [](double reference_ns) {
    return FreeRunningTime::from_ns(std::llround(1e9 + reference_ns * (1.0 + 20e-6)));
  };
  oscillator.instant = reading(0.0);
  test::WatchedClock clock(
      oscillator, Duration::from_ns(kMillisecond) - Duration{oscillator.instant.since_epoch()},
      RateLimits::symmetric_ppb(30e6));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> lateness_ms(2.0, 14.0);
  clock.lateness = Duration::from_ns(lateness_ms.max() * kMillisecond);
  ClockDiscipline discipline({}, clock);
  double worst = 0.0;
  const auto message = [&](Direction direction, double sent_ns) {
    const double arrived_ns = sent_ns + kDelayNs;
    const bool forward = direction == Direction::kForward;
    oscillator.instant = reading(arrived_ns + 20e3);
    clock.ends_late_by = Duration::from_ns(lateness_ms(random) * kMillisecond);
    (void)discipline.on_pair({direction,
                              ReferenceTime::from_ns(std::llround(forward ? sent_ns : arrived_ns)),
                              reading(forward ? arrived_ns : sent_ns)});
    if (sent_ns > 30e9) {
      const double error_ns = clock.read().local.since_epoch().ns() - (arrived_ns + 20e3);
      worst = std::max(worst, std::abs(error_ns));
    }
  };
  const int cycles = static_cast<int>(60e9 / interval_ns);
  for (int n = 1; n <= cycles; ++n) {
    message(Direction::kForward, n * interval_ns);
    message(Direction::kBackward, (n + 0.5) * interval_ns);
  }
  return worst;
}

// An eighth of these intervals is 3.9 and 7.8 ms: less than corrections are late by.
TEST(LateExpiry, corrections_that_end_later_than_they_were_to_last_do_not_throw_the_clock) {
  for (const double interval_ms : {31.25, 62.5}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      EXPECT_LT(worst_ns(interval_ms * kMillisecond, seed), 10.0) << interval_ms << ", " << seed;
    }
  }
}

}  // namespace
}  // namespace ftcs
