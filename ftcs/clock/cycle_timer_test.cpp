// SPDX-License-Identifier: MIT
#include "ftcs/clock/cycle_timer.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "test/support/manual_source.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::ManualSource;

// The world: an unsteered clock whose timer fires on a grid of 10 us (the paper's RTX), and a cycle
// of 20 ms of steered time, whose first trigger is due at the start of both.
constexpr CycleTimerConfig kRtx{
    .first = LocalTime{}, .cycle_time = Nanoseconds{20'000'000}, .resolution = Nanoseconds{10'000}};

struct World {
  ManualSource source;
  VirtualClock clock{source, {.free_running = {}, .local = {}, .rate = {}, .limits = {}}};
  CycleTimer timer{kRtx};

  CycleTrigger next() { return timer.next(clock.history()); }
  void steer(Rate rate) {
    ASSERT_TRUE(
        clock
            .apply(
                {.correction_rate = {}, .correction_time = {}, .tracking_rate = rate, .step = {}})
            .ok());
  }
};

TEST(CycleTimer, trigger_sits_on_the_grid_and_says_how_far_off_it_is) {
  World world;
  world.steer(Rate::from_ratio(1.0 / (1.0 + 123e-6)));  // T_m = 20.00246 ms
  EXPECT_EQ(world.next().scheduled, FreeRunningTime{});
  world.timer.advance();
  const CycleTrigger trigger = world.next();
  EXPECT_EQ(trigger.local, LocalTime{Duration{20ms}});
  EXPECT_NEAR(trigger.virtual_instant.since_epoch().ns(), 20'002'460.0, 1e-6);
  EXPECT_EQ(trigger.scheduled, FreeRunningTime::from_ns(20'000'000));
  EXPECT_NEAR(trigger.rounding().ns(), -2'460.0, 1e-6);
  world.timer.advance();
  world.timer.advance();
  EXPECT_EQ(world.next().scheduled, FreeRunningTime::from_ns(60'010'000));  // 60 007 380
  EXPECT_NEAR(world.next().rounding().ns(), 2'620.0, 1e-5);
}

TEST(CycleTimerConfig, of_no_length_is_not_valid) {
  EXPECT_TRUE(kRtx.valid());
  EXPECT_FALSE(CycleTimerConfig{}.valid()) << "a cycle has no default";
  for (const Nanoseconds length : {Nanoseconds{0}, Nanoseconds{-1}}) {
    CycleTimerConfig config = kRtx;
    config.cycle_time = length;
    EXPECT_FALSE(config.valid());
    config = kRtx;
    config.resolution = length;
    EXPECT_FALSE(config.valid());
  }
}

TEST(CycleTimer, rounding_never_accumulates) {
  World world;
  const double cycle_ns = 20e6 * (1.0 + 17.3e-6);
  world.steer(Rate::from_ratio(20e6 / cycle_ns));
  for (int n = 0; n < 100'000; ++n) {
    const CycleTrigger trigger = world.next();
    ASSERT_LE(std::abs(trigger.rounding().ns()), 5'000.0);
    ASSERT_NEAR(trigger.virtual_instant.since_epoch().ns() - n * cycle_ns, 0.0, 1e-2);
    world.timer.advance();
  }
}

TEST(CycleTimer, half_a_tick_goes_upward_before_and_after_the_epoch) {
  const auto scheduled = [](std::int64_t ns) {
    ManualSource source;
    const VirtualClock clock{source, {.free_running = {}, .local = {}, .rate = {}, .limits = {}}};
    CycleTimerConfig config = kRtx;
    config.first = LocalTime::from_ns(ns);
    return CycleTimer{config}.next(clock.history()).scheduled.since_epoch().floor_ns();
  };
  EXPECT_EQ(scheduled(5'000), 10'000);
  EXPECT_EQ(scheduled(4'999), 0);
  EXPECT_EQ(scheduled(10'000), 10'000);
  EXPECT_EQ(scheduled(-4'999), 0);
  EXPECT_EQ(scheduled(-5'000), 0);
  EXPECT_EQ(scheduled(-5'001), -10'000);
  EXPECT_EQ(scheduled(-10'000), -10'000);
  EXPECT_EQ(scheduled(-15'001), -20'000);
}

TEST(CycleTimer, command_moves_the_next_trigger) {
  World world;
  world.timer.advance();
  EXPECT_EQ(world.next().scheduled, FreeRunningTime{Duration{20ms}});
  world.source.instant = FreeRunningTime{Duration{10ms}};
  world.steer(Rate::from_ratio(0.5));
  EXPECT_EQ(world.next().scheduled, FreeRunningTime{Duration{30ms}});
  EXPECT_EQ(world.next().rounding(), Duration{});
}

TEST(CycleTimer, missed_triggers_are_passed_over_and_counted) {
  World world;
  EXPECT_EQ(world.timer.skip_missed(LocalTime::from_ns(-1)), 0);
  EXPECT_EQ(world.next().local, LocalTime{});
  EXPECT_EQ(world.timer.skip_missed(LocalTime{}), 1);
  EXPECT_EQ(world.next().local, LocalTime{Duration{20ms}});
  EXPECT_EQ(world.timer.skip_missed(LocalTime{Duration{79ms}}), 3);
  EXPECT_EQ(world.next().local, LocalTime{Duration{80ms}});
  EXPECT_EQ(world.timer.skip_missed(LocalTime{Duration{100ms}}), 2);
  EXPECT_EQ(world.next().local, LocalTime{Duration{120ms}});
  EXPECT_EQ(world.timer.skip_missed(LocalTime{Duration{60ms}}), 0);
  EXPECT_EQ(world.next().local, LocalTime{Duration{120ms}});
}

TEST(CycleTimer, rounding_error_of_a_coarse_timer_is_uniform_over_one_tick) {
  // 10 us / sqrt(12) = 2887 ns: no trigger on that grid can be better (paper, Table 6).
  World world;
  std::mt19937_64 random(5);
  double sum = 0.0;
  constexpr int kCycles = 20'000;
  for (int n = 0; n < kCycles; ++n) {
    world.source.instant = world.next().virtual_instant;
    world.steer(Rate::from_ppm(static_cast<double>(random() % 100'000) * 1e-3));
    world.timer.advance();
    const double rounding = world.next().rounding().ns();
    sum += rounding * rounding;
  }
  EXPECT_NEAR(std::sqrt(sum / kCycles), 10'000.0 / std::sqrt(12.0), 50.0);
}

}  // namespace
}  // namespace ftcs
