// SPDX-License-Identifier: MIT
#include "ftcs/clock/steering_history.h"

#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

// The world: a clock that starts at local 0 = free running 0 with rate 1 and is steered in
// nanosecond steps small enough to be followed by hand.
using Map = SteeringHistory::Map;

constexpr FreeRunningTime free_at(std::int64_t ns) { return FreeRunningTime::from_ns(ns); }
constexpr LocalTime local_at(std::int64_t ns) { return LocalTime::from_ns(ns); }

SteeringHistory nominal() { return SteeringHistory{Map{free_at(0), local_at(0), Rate{}}}; }

TEST(SteeringHistory, late_stamp_is_converted_by_the_segment_in_which_it_was_taken) {
  SteeringHistory history = nominal();
  history.steer(free_at(100), Rate::from_ratio(1.5));
  history.steer(free_at(200), Rate::from_ratio(0.5));
  EXPECT_EQ(history.local_at(free_at(50)), local_at(50));
  EXPECT_EQ(history.local_at(free_at(100)), local_at(100));
  EXPECT_EQ(history.local_at(free_at(150)), local_at(175));
  EXPECT_EQ(history.local_at(free_at(200)), local_at(250));
  EXPECT_EQ(history.local_at(free_at(300)), local_at(300));
  EXPECT_EQ(history.rate_at(free_at(99)), Rate{});
  EXPECT_EQ(history.rate_at(free_at(100)), Rate::from_ratio(1.5));
  EXPECT_EQ(history.rate_at(free_at(500)), Rate::from_ratio(0.5));
  EXPECT_EQ(history.free_running_at(local_at(50)), free_at(50));
  EXPECT_EQ(history.free_running_at(local_at(175)), free_at(150));
  EXPECT_EQ(history.free_running_at(local_at(250)), free_at(200));
  EXPECT_EQ(history.free_running_at(local_at(300)), free_at(300));
}

TEST(SteeringHistory, before_its_oldest_segment_it_extends_that) {
  SteeringHistory history{Map{free_at(0), local_at(0), Rate::from_ratio(2.0)}};
  history.steer(free_at(100), Rate{});
  EXPECT_EQ(history.local_at(free_at(-10)), local_at(-20));
  EXPECT_EQ(history.free_running_at(local_at(-20)), free_at(-10));
}

TEST(SteeringHistory, what_was_planned_for_later_is_dropped_by_a_new_command) {
  SteeringHistory history = nominal();
  history.steer(free_at(100), Rate::from_ratio(1.5));
  history.steer(free_at(200), Rate{});  // the correction's planned end
  history.steer(free_at(160), Rate::from_ratio(0.5));
  EXPECT_EQ(history.local_at(free_at(160)), local_at(190));
  EXPECT_EQ(history.local_at(free_at(260)), local_at(240));
  EXPECT_EQ(history.rate_at(free_at(201)), Rate::from_ratio(0.5));
}

TEST(SteeringHistory, command_at_the_same_instant_replaces_the_former) {
  SteeringHistory history = nominal();
  history.steer(free_at(100), Rate::from_ratio(1.5), Duration{7ns});
  history.steer(free_at(100), Rate::from_ratio(0.5));
  EXPECT_EQ(history.local_at(free_at(100)), local_at(107));
  EXPECT_EQ(history.local_at(free_at(200)), local_at(157));
  EXPECT_EQ(history.local_at(free_at(50)), local_at(50));
}

TEST(SteeringHistory, step_is_a_boundary_between_segments) {
  SteeringHistory history = nominal();
  history.steer(free_at(100), Rate::from_ratio(2.0), Duration{1000ns});
  EXPECT_EQ(history.local_at(free_at(99)), local_at(99));
  EXPECT_EQ(history.local_at(free_at(100)), local_at(1100));
  EXPECT_EQ(history.local_at(free_at(101)), local_at(1102));
  // Local times that were never shown belong to the step.
  EXPECT_EQ(history.free_running_at(local_at(99)), free_at(99));
  EXPECT_EQ(history.free_running_at(local_at(500)), free_at(100));
  EXPECT_EQ(history.free_running_at(local_at(1100)), free_at(100));
  EXPECT_EQ(history.free_running_at(local_at(1102)), free_at(101));
}

TEST(SteeringHistory, of_two_instants_with_one_local_time_the_later_counts) {
  SteeringHistory history = nominal();
  history.steer(free_at(100), Rate{}, Duration{-50ns});
  EXPECT_EQ(history.local_at(free_at(100)), local_at(50));
  EXPECT_EQ(history.free_running_at(local_at(70)), free_at(120));
  EXPECT_EQ(history.free_running_at(local_at(50)), free_at(100));
  EXPECT_EQ(history.free_running_at(local_at(49)), free_at(49));
}

TEST(SteeringHistory, forgets_the_oldest_of_more_than_sixteen_segments) {
  SteeringHistory history = nominal();
  for (int i = 1; i <= 40; ++i) {
    history.steer(free_at(100 * i), i % 2 == 0 ? Rate::from_ratio(0.5) : Rate::from_ratio(1.5));
  }
  // Rates 1.5 and 0.5 take turns: every 200 ns advance by 200. The newest segment starts at 4000.
  EXPECT_EQ(history.local_at(free_at(4000)), local_at(4050));
  EXPECT_EQ(history.local_at(free_at(2500)), local_at(2500));
  EXPECT_EQ(history.local_at(free_at(2550)), local_at(2575));
  // The sixteenth, from 2500 on, at rate 1.5, stands for everything before.
  EXPECT_EQ(history.local_at(free_at(2300)), local_at(2200));
  EXPECT_EQ(history.free_running_at(local_at(2200)), free_at(2300));
}

TEST(SteeringHistory, oscillator_that_goes_backward_replaces_the_future_it_takes_back) {
  SteeringHistory history = nominal();
  history.steer(free_at(1000), Rate::from_ratio(1.5));
  history.steer(free_at(2000), Rate::from_ratio(0.5));
  history.steer(free_at(-500), Rate::from_ratio(2.0));
  EXPECT_EQ(history.local_at(free_at(-500)), local_at(-500));
  EXPECT_EQ(history.local_at(free_at(3000)), local_at(6500));
}

TEST(SteeringHistory, counter_that_wraps_keeps_the_order_of_segments) {
  const auto last = free_at(std::numeric_limits<std::int64_t>::max());
  SteeringHistory history{Map{last - Duration{100ns}, local_at(0), Rate{}}};
  history.steer(last + Duration{100ns}, Rate::from_ratio(1.5));
  EXPECT_EQ(history.local_at(last), local_at(100));
  EXPECT_EQ(history.local_at(last + Duration{300ns}), local_at(500));
  EXPECT_EQ(history.free_running_at(local_at(500)), last + Duration{300ns});
}

}  // namespace
}  // namespace ftcs
