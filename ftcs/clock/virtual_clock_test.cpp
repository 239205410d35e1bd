// SPDX-License-Identifier: MIT
#include "ftcs/clock/virtual_clock.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

// The world: an oscillator that shows what the test says, and a clock on it that starts at 5 s when
// the oscillator shows 1 s.
struct ManualSource final : FreeRunningSource {
  FreeRunningTime instant = FreeRunningTime::from_ns(1'000'000'000);
  [[nodiscard]] FreeRunningTime now() noexcept override { return instant; }
};

struct World {
  ManualSource source;
  VirtualClock clock{source,
                     {.free_running = FreeRunningTime::from_ns(1'000'000'000),
                      .local = LocalTime::from_ns(5'000'000'000),
                      .rate = {},
                      .limits = RateLimits::symmetric_ppb(1e8)}};
};

TEST(VirtualClock, correction_expires_although_nobody_calls) {
  World world;
  // 1 ms within 125 ms, then 50 ppm: the time the correction lasts is reference time.
  const ServoCommand command{.correction_rate = Rate::from_ratio(1.00005 * 1.008),
                             .correction_time = Duration{125ms},
                             .tracking_rate = Rate::from_ratio(1.00005),
                             .step = {}};
  ASSERT_TRUE(world.clock.apply(command).ok());
  world.source.instant = world.source.instant + Duration{10s};
  const double expected = 5e9 + 10e9 * 1.00005 + 125e6 * 0.008;
  EXPECT_NEAR(world.clock.read().local.since_epoch().ns(), expected, 2e-6);
}

}  // namespace
}  // namespace ftcs
