// SPDX-License-Identifier: MIT
#include "ftcs/clock/virtual_clock.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/clock/skewed_source.h"
#include "test/support/exact_clock.h"
#include "test/support/forbid_allocation.h"
#include "test/support/manual_source.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::ExactClock;
using test::ManualSource;

// The world: an oscillator that shows what the test says, and a clock on it that shows 5 s when the
// oscillator shows 1 s.
constexpr auto kStart = FreeRunningTime::from_ns(1'000'000'000);
constexpr auto kLocalStart = LocalTime::from_ns(5'000'000'000);

struct World {
  ManualSource source;
  VirtualClock clock;

  explicit World(Rate rate = {}, RateLimits limits = RateLimits::symmetric_ppb(5e8))
      : clock(source,
              {.free_running = kStart, .local = kLocalStart, .rate = rate, .limits = limits}) {
    source.instant = kStart;
  }
  // Local time since the start, `after` the start of the oscillator.
  Duration shown(Duration after) {
    source.instant = kStart + after;
    return clock.read().local - kLocalStart;
  }
};

ServoCommand correction(double correction_ratio, Duration time, double tracking_ratio) {
  return {.correction_rate = Rate::from_ratio(correction_ratio),
          .correction_time = time,
          .tracking_rate = Rate::from_ratio(tracking_ratio),
          .step = {}};
}
ServoCommand tracking(double ratio, Duration step = {}) {
  return {.correction_rate = {},
          .correction_time = {},
          .tracking_rate = Rate::from_ratio(ratio),
          .step = step};
}

TEST(VirtualClock, runs_at_its_initial_rate) {
  World world{Rate::from_ratio(1.25)};
  EXPECT_EQ(world.shown(Duration{}), Duration{});
  EXPECT_EQ(world.shown(Duration{4s}), Duration{5s});
  EXPECT_EQ(world.clock.read().free_running, kStart + Duration{4s});
  EXPECT_EQ(world.clock.local_at(kStart + Duration{8s}), kLocalStart + Duration{10s});
}

TEST(VirtualClock, correction_expires_although_nobody_calls) {
  World world;
  ASSERT_TRUE(world.clock.apply(correction(1.5, Duration{1s}, 1.25)).ok());
  // 1 s of reference time is 0.8 s of the oscillator; 0.8 s at 1.5 are 1.2 s.
  EXPECT_EQ(world.shown(Duration{400ms}), Duration{600ms});
  EXPECT_EQ(world.shown(Duration{800ms}), Duration{1200ms});
  EXPECT_EQ(world.shown(Duration{1600ms}), Duration{2200ms});
}

TEST(VirtualClock, removes_an_offset_within_the_correction_time_at_any_skew) {
  // Paper eq. (17): the reference runs at k = 1.008 of the oscillator; 1 ms within 125 ms of
  // reference time.
  constexpr double kRatio = 1.008;
  World world;
  ASSERT_TRUE(
      world.clock.apply(correction(kRatio * (1.0 + 1e6 / 125e6), Duration{125ms}, kRatio)).ok());
  for (const Duration after : {Duration{125ms}, Duration{10s}}) {
    EXPECT_NEAR(world.shown(after).ns() - 1e6, after.ns() * kRatio, 1e-5);
  }
}

TEST(VirtualClock, command_replaces_its_predecessor) {
  World world;
  ASSERT_TRUE(world.clock.apply(correction(1.5, Duration{1s}, 1.25)).ok());
  world.source.instant = kStart + Duration{400ms};
  ASSERT_TRUE(world.clock.apply(tracking(0.75)).ok());
  EXPECT_EQ(world.shown(Duration{2400ms}), Duration{600ms} + Duration{1500ms});
  // A stamp of the time before is still known.
  EXPECT_EQ(world.clock.local_at(kStart + Duration{200ms}), kLocalStart + Duration{300ms});
}

TEST(VirtualClock, step_comes_first_and_once) {
  World world;
  ServoCommand command = correction(1.5, Duration{1s}, 1.25);
  command.step = Duration{-1ms};
  const auto applied = world.clock.apply(command);
  ASSERT_TRUE(applied.ok());
  EXPECT_EQ(applied->free_running, kStart);
  EXPECT_EQ(applied->local, kLocalStart - Duration{1ms});
  EXPECT_EQ(world.shown(Duration{1600ms}), Duration{2200ms} - Duration{1ms});
  ASSERT_TRUE(world.clock.apply(tracking(1.0, Duration{2ms})).ok());
  EXPECT_EQ(world.clock.read().local - kLocalStart, Duration{2200ms} + Duration{1ms});
}

TEST(VirtualClock, correction_of_no_or_negative_length_does_not_take_place) {
  for (const Duration length : {Duration{}, Duration{-1s}}) {
    World world;
    ASSERT_TRUE(world.clock.apply(correction(1.5, length, 1.25)).ok());
    EXPECT_EQ(world.shown(Duration{4s}), Duration{5s});
    // Its rate is not looked at, as long as it is a number.
    EXPECT_TRUE(world.clock.apply(correction(7.0, length, 1.25)).ok());
  }
  World world;
  ASSERT_TRUE(world.clock.apply(correction(1.5, Duration{1ns}, 1.0)).ok());
  EXPECT_EQ(world.shown(Duration{1s}), Duration{1s} + Duration::from_ns(0.5));
}

TEST(VirtualClock, refuses_what_is_no_rate_and_changes_nothing) {
  World world{Rate{}, RateLimits::symmetric_ppb(1e6)};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const auto& command :
       {correction(nan, Duration{1s}, 1.0), correction(1.0, Duration{1s}, nan),
        correction(infinity, Duration{}, 1.0), tracking(-infinity)}) {
    const auto result = world.clock.apply(command);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error(), ClockError::kNotFinite);
  }
  for (const auto& command :
       {correction(1.0011, Duration{1s}, 1.0), correction(1.0, Duration{1s}, 0.9989),
        correction(0.9989, Duration{1s}, 1.0), tracking(1.0011)}) {
    const auto result = world.clock.apply(command);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error(), ClockError::kRateOutOfLimits);
  }
  EXPECT_EQ(world.shown(Duration{100s}), Duration{100s});
  EXPECT_TRUE(world.clock.apply(correction(1.001, Duration{1s}, 0.999)).ok());
}

TEST(VirtualClock, limits_are_narrowed_to_what_it_can_hold) {
  const World world{Rate{}, RateLimits{Rate::from_ratio(1e-9), Rate::from_ratio(1e5)}};
  EXPECT_EQ(world.clock.rate_limits().slowest.ratio(), 1.0 / 1024.0);
  EXPECT_EQ(world.clock.rate_limits().fastest.ratio(), 1023.0);
  World limited{Rate::from_ratio(1.5), RateLimits::symmetric_ppb(1e8)};
  EXPECT_EQ(limited.clock.rate_limits().fastest, Rate::from_ppb(1e8));
  EXPECT_NEAR(limited.shown(Duration{1s}).ns(), 1.1e9, 1e-3);
}

TEST(VirtualClock, command_can_be_applied_at_a_known_instant) {
  World world;
  const auto applied = world.clock.apply_at(kStart + Duration{1s}, tracking(1.5));
  ASSERT_TRUE(applied.ok());
  EXPECT_EQ(applied->free_running, kStart + Duration{1s});
  EXPECT_EQ(applied->local, kLocalStart + Duration{1s});
  EXPECT_EQ(world.shown(Duration{3s}), Duration{4s});
  EXPECT_EQ(world.clock.history().rate_at(kStart + Duration{1s}), Rate::from_ratio(1.5));
}

TEST(VirtualClock, ten_million_steers_leave_no_error) {
  World world;
  ExactClock exact;
  std::mt19937_64 random(7);
  const test::ForbidAllocation guard;
  for (int i = 0; i < 10'000'000; ++i) {
    const auto noise = random();
    const auto interval = Duration::from_parts(1'000, static_cast<std::uint32_t>(noise));
    world.source.instant = world.source.instant + interval;
    const Rate rate = Rate::from_ratio(0.9 + 0.2 * static_cast<double>(noise >> 32) / 4294967296.0);
    exact.run(interval);
    exact.set_rate(rate);
    ASSERT_TRUE(world.clock.apply(tracking(rate.ratio())).ok());
  }
  EXPECT_EQ(world.clock.read().local, kLocalStart + exact.shown());
}

TEST(VirtualClock, never_runs_backward_between_steps) {
  World world;
  std::mt19937_64 random(8);
  LocalTime last = world.clock.read().local;
  for (int i = 0; i < 100'000; ++i) {
    world.source.instant =
        world.source.instant + Duration::from_parts(0, static_cast<std::uint32_t>(random()));
    const LocalTime now = world.clock.read().local;
    ASSERT_GE(now, last);
    last = now;
    if (i % 5 == 0) {
      const double ratio = 0.6 + static_cast<double>(random() % 1000) * 1e-3 * 0.8;
      ASSERT_TRUE(world.clock.apply(correction(ratio, Duration::from_ns(1.5), 1.0)).ok());
    }
  }
}

TEST(SkewedSource, carries_the_skew_so_that_no_servo_can_know_it) {
  ManualSource underlying;
  underlying.instant = kStart;
  SkewedSource skewed{underlying, Rate::from_ppm(50.0), kStart};
  EXPECT_EQ(skewed.now(), kStart);
  underlying.instant = kStart + Duration{1s};
  EXPECT_NEAR((skewed.now() - kStart).ns(), 1e9 + 50e3, 1e-6);
  EXPECT_EQ(skewed.from_underlying(underlying.instant), skewed.now());
  EXPECT_NEAR((skewed.to_underlying(skewed.now()) - underlying.instant).ns(), 0.0, 1e-9);
}

}  // namespace
}  // namespace ftcs
