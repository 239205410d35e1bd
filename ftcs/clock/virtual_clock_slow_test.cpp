// SPDX-License-Identifier: MIT
#include <random>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "test/support/exact_clock.h"
#include "test/support/manual_source.h"

namespace ftcs {
namespace {

// The world: a clock that is steered every microsecond or so, 10^9 times: at the paper's 100 us
// that is a day, at one second a man's life. Oracle: the same sum in 128-bit integers.
TEST(VirtualClock, thousand_million_steers_leave_no_error) {
  test::ManualSource source;
  VirtualClock clock{source, {.free_running = {}, .local = {}, .rate = {}, .limits = {}}};
  test::ExactClock exact;
  std::minstd_rand random(1);
  for (int i = 0; i < 1'000'000'000; ++i) {
    const std::uint32_t noise = static_cast<std::uint32_t>(random());
    const auto interval = Duration::from_parts(1'000, noise);
    source.instant = source.instant + interval;
    const Rate rate = Rate::from_ratio(0.9 + static_cast<double>(noise) / 21474836480.0);
    exact.run(interval);
    exact.set_rate(rate);
    ASSERT_TRUE(
        clock
            .apply(
                {.correction_rate = {}, .correction_time = {}, .tracking_rate = rate, .step = {}})
            .ok());
  }
  EXPECT_EQ(clock.read().local.since_epoch(), exact.shown());
}

}  // namespace
}  // namespace ftcs
