// SPDX-License-Identifier: MIT
// World: times with jitter, gaps and mistakes.
#include "ftcs/record/time_grid.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

std::vector<double> count_up(std::size_t count) {
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<double>(i);
  return values;
}

TEST(TimeGrid, takes_the_median_step_and_leaves_gaps_open) {
  const double times[] = {10.0, 10.5, 11.0, 13.0, 13.5};
  const auto grid = place_on_grid(count_up(5), times, std::nullopt);
  ASSERT_TRUE(grid.ok());
  EXPECT_EQ(grid->interval_s, 0.5);
  ASSERT_EQ(grid->values.size(), 8U);
  EXPECT_TRUE(std::isnan(grid->values[3]) && std::isnan(grid->values[5]));
  EXPECT_EQ(grid->values[6], 3.0);
}

TEST(TimeGrid, finds_an_interval_that_the_stamps_are_too_coarse_to_show) {
  for (const double interval : {0.0625, 0.125, 0.0078125, 1.0, 0.1}) {
    std::vector<double> times(4000);
    for (std::size_t i = 0; i < times.size(); ++i) {
      times[i] = std::round((17.3 + interval * static_cast<double>(i)) * 1e3) * 1e-3;
    }
    times.erase(times.begin() + 100, times.begin() + 140);  // a gap
    const auto grid = place_on_grid(count_up(times.size()), times, std::nullopt);
    ASSERT_TRUE(grid.ok());
    EXPECT_DOUBLE_EQ(grid->interval_s, interval);
    EXPECT_EQ(grid->values.size(), 4000U);
    EXPECT_EQ(grid->crowded, 0U);
  }
}

TEST(TimeGrid, does_not_call_a_clock_that_is_slow_by_ten_ppm_exact) {
  std::vector<double> times = count_up(100000);
  for (double& time : times) time *= 1.00001;
  const auto grid = place_on_grid(count_up(times.size()), times, std::nullopt);
  ASSERT_TRUE(grid.ok());
  EXPECT_NEAR(grid->interval_s, 1.00001, 1e-9);
}

TEST(TimeGrid, is_not_moved_by_jitter_nor_by_an_interval_that_is_slightly_wrong) {
  std::vector<double> times = count_up(10000);
  for (double& time : times) {
    time = time * 1.001 + 0.3 * (std::fmod(time * 7919.0, 100.0) / 100.0 - 0.5);
  }
  const auto grid = place_on_grid(count_up(times.size()), times, 1.0);
  ASSERT_TRUE(grid.ok());
  EXPECT_EQ(grid->values.size(), times.size());
  EXPECT_EQ(grid->crowded, 0U);
}

TEST(TimeGrid, keeps_values_that_came_too_early) {
  const double times[] = {0.0, 1.0, 1.1, 2.0, 3.0};
  const auto grid = place_on_grid(count_up(5), times, 1.0);
  ASSERT_TRUE(grid.ok());
  EXPECT_EQ(grid->crowded, 1U);
  EXPECT_EQ(grid->values, count_up(5));
}

TEST(TimeGrid, refuses_times_that_cannot_be_meant) {
  const double stuck[] = {1.0, 1.0, 1.0, 2.0};
  EXPECT_FALSE(place_on_grid(count_up(4), stuck, std::nullopt).ok());
  const double jump[] = {0.0, 1.0, 2.0, 1e12};
  const auto grid = place_on_grid(count_up(4), jump, std::nullopt);
  ASSERT_FALSE(grid.ok());
  EXPECT_NE(grid.error().message.find("intervals"), std::string::npos);
}

}  // namespace
}  // namespace ftcs
