// SPDX-License-Identifier: MIT
// World: a virtual clock on an oscillator 50 ppm fast and 100 us ahead, exact messages, and a
// discipline that was told by how much the rate may change at a time. The clock notes every change.
#include "ftcs/discipline/rate_change_limit.h"

#include <cmath>

#include <gtest/gtest.h>

#include "ftcs/discipline/clock_discipline.h"
#include "test/support/manual_source.h"
#include "test/support/watched_clock.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;

constexpr double kLimit = 10e-6;
constexpr double kRounding = 1e-13;

struct World {
  explicit World(double limit, double granularity = 0.0, ServoKind kind = ServoKind::kAdaptive)
      : discipline(config(limit, granularity, kind), clock) {}
  static DisciplineConfig config(double limit, double granularity, ServoKind kind) {
    DisciplineConfig config;
    config.servo.kind = kind;
    config.servo.sync_interval = 125ms;
    config.servo.two_way.fixed_path_delay = 0ns;
    config.servo.adaptive.steering.rate_granularity = granularity;
    config.largest_rate_change = limit;
    return config;
  }
  [[nodiscard]] ReferenceTime reference() const {
    return ReferenceTime{scale(oscillator.instant.since_epoch(), Rate::from_ppm(-50.0))};
  }
  [[nodiscard]] double offset_ns() {
    return offset_from_reference(clock.read().local, reference()).ns();
  }
  void sync() { discipline.on_pair({Direction::kForward, reference(), oscillator.instant}); }
  void run(int messages) {
    for (int i = 0; i < messages; ++i) {
      sync();
      // Now and then a message comes before the correction of the one before it has ended.
      oscillator.instant = oscillator.instant + Duration{i % 5 == 0 ? 15ms : 125ms};
    }
  }

  test::ManualSource oscillator;
  test::WatchedClock clock{oscillator, Duration{100us}};
  ClockDiscipline discipline;
};

TEST(RateChangeLimit, holds_from_the_first_command_on_and_the_clock_still_gets_there) {
  World free(0.0);
  free.run(20);
  EXPECT_GT(free.clock.largest_change, 3.0 * kLimit) << "a world that asks for more";

  World limited(kLimit);
  limited.run(600);
  EXPECT_LE(limited.clock.largest_change, kLimit + kRounding);
  EXPECT_GT(limited.clock.largest_change, 0.4 * kLimit) << "and not slower than it need be";
  EXPECT_NEAR(limited.offset_ns(), 0.0, 10.0);
  EXPECT_TRUE(limited.discipline.locked());
}

TEST(RateChangeLimit, holds_with_rates_that_are_rounded) {
  constexpr double kGranularity = 1e-6;
  World world(kLimit, kGranularity);
  world.run(600);
  EXPECT_LE(world.clock.largest_change, kLimit + kRounding);
  const double steps = (world.clock.last.tracking_rate.ratio() - 1.0) / kGranularity;
  EXPECT_NEAR(steps, std::round(steps), 1e-6);
  EXPECT_LT(std::abs(world.offset_ns()), 1'000.0);
}

TEST(RateChangeLimit, holds_over_a_new_reference_and_for_a_rate_known_beforehand) {
  World world(kLimit);
  EXPECT_FALSE(world.discipline.start_at(Rate::from_ppm(-50.0)).has_value());
  EXPECT_NEAR(world.clock.rate(), 1.0 - kLimit, kRounding) << "the first of five steps";
  world.run(100);
  world.discipline.on_new_reference();
  world.run(100);
  EXPECT_LE(world.clock.largest_change, kLimit + kRounding);
}

TEST(RateChangeLimit, cuts_the_commands_of_a_servo_that_knows_nothing_of_it) {
  World world(kLimit, 0.0, ServoKind::kFtcs);
  world.run(100);
  EXPECT_LE(world.clock.largest_change, kLimit + kRounding);
}

}  // namespace
}  // namespace ftcs
