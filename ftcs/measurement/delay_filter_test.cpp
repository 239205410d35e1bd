// SPDX-License-Identifier: MIT
#include "ftcs/measurement/delay_filter.h"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

// The world: delays of some microseconds in a random order. Oracle: a sorted copy of the last
// values.
DelayFilter filter(DelayFilterKind kind, std::size_t length) {
  return DelayFilter{{.kind = kind, .length = length}};
}

TEST(DelayFilter, is_empty_and_zero_at_first) {
  const DelayFilter median{DelayFilterConfig{}};
  EXPECT_TRUE(median.empty());
  EXPECT_EQ(median.value(), Duration{});
}

TEST(DelayFilter, follows_a_sorted_copy_of_the_last_values) {
  for (const std::size_t length : {1U, 2U, 3U, 10U, 31U, 32U}) {
    auto median = filter(DelayFilterKind::kMovingMedian, length);
    auto minimum = filter(DelayFilterKind::kMovingMinimum, length);
    std::deque<std::int64_t> last;
    std::mt19937 random(9);
    for (int i = 0; i < 200; ++i) {
      const std::int64_t ns = static_cast<std::int64_t>(random() % 2'000) - 100;
      last.push_back(ns);
      if (last.size() > length) last.pop_front();
      std::vector<std::int64_t> sorted(last.begin(), last.end());
      std::sort(sorted.begin(), sorted.end());
      median.add(Duration::from_whole_ns(ns));
      minimum.add(Duration::from_whole_ns(ns));
      ASSERT_FALSE(median.empty());
      ASSERT_EQ(minimum.value().ns(), static_cast<double>(sorted.front()));
      const std::size_t n = sorted.size();
      const double middle = static_cast<double>(sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0;
      ASSERT_EQ(median.value().ns(), middle) << "length " << length << ", value " << i;
    }
  }
}

TEST(DelayFilter, impossible_lengths_become_the_nearest_possible) {
  auto none = filter(DelayFilterKind::kMovingMedian, 0);
  none.add(Duration::from_ns(5.0));
  none.add(Duration::from_ns(7.0));
  EXPECT_EQ(none.value(), Duration::from_ns(7.0));
  auto too_long = filter(DelayFilterKind::kMovingMinimum, 1'000);
  too_long.add(Duration::from_ns(1.0));
  for (std::size_t i = 1; i < DelayFilter::kCapacity; ++i) too_long.add(Duration::from_ns(2.0));
  EXPECT_EQ(too_long.value(), Duration::from_ns(1.0));
  too_long.add(Duration::from_ns(2.0));
  EXPECT_EQ(too_long.value(), Duration::from_ns(2.0));
}

TEST(DelayFilter, steady_mean_is_the_median_until_all_have_come) {
  auto steady = filter(DelayFilterKind::kSteadyMean, 1);  // that is, five
  for (const double ns : {9.0, 1.0, 2.0, 4.0}) steady.add(Duration::from_ns(ns));
  EXPECT_EQ(steady.value(), Duration::from_ns(3.0));
  steady.add(Duration::from_ns(3.0));
  EXPECT_EQ(steady.value(), Duration::from_ns(3.0));
  steady.reset();
  EXPECT_TRUE(steady.empty());
  steady.add(Duration::from_ns(50.0));
  EXPECT_EQ(steady.value(), Duration::from_ns(50.0)) << "nothing is left of the values before";
}

TEST(DelayFilter, default_is_the_median_of_ten) {
  DelayFilter median{DelayFilterConfig{}};
  for (const double ns : {9.0, 1.0, 1.0, 1.0, 1.0, 3.0, 5.0, 5.0, 5.0, 5.0, 5.0})
    median.add(Duration::from_ns(ns));
  EXPECT_EQ(median.value(), Duration::from_ns(4.0));  // without the nine
}

TEST(DelayFilter, reset_forgets) {
  auto minimum = filter(DelayFilterKind::kMovingMinimum, 4);
  minimum.add(Duration::from_ns(1.0));
  minimum.add(Duration::from_ns(2.0));
  minimum.reset();
  EXPECT_TRUE(minimum.empty());
  EXPECT_EQ(minimum.value(), Duration{});
  minimum.add(Duration::from_ns(8.0));
  EXPECT_EQ(minimum.value(), Duration::from_ns(8.0));
  minimum.add(Duration::from_ns(9.0));
  minimum.add(Duration::from_ns(9.0));
  minimum.add(Duration::from_ns(9.0));
  EXPECT_EQ(minimum.value(), Duration::from_ns(8.0));
}

}  // namespace
}  // namespace ftcs
