// SPDX-License-Identifier: MIT
// World: a stream of noise; oracle is sorting the last values anew each time.
#include "ftcs/estimation/sorted_window.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

float upper_median(std::vector<float> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

TEST(SortedWindow, agrees_with_sorting_anew) {
  std::mt19937_64 random(1);
  SortedWindow<32> window;
  std::deque<float> last;
  for (int i = 0; i < 5000; ++i) {
    // Many equal values on purpose.
    const auto value = static_cast<float>(static_cast<int>(random() % 40) - 20);
    window.push(static_cast<double>(value));
    last.push_back(value);
    if (last.size() > 32) last.pop_front();
    const std::vector<float> values(last.begin(), last.end());
    const float median = upper_median(values);
    std::vector<float> distance;
    for (float v : values) distance.push_back(std::abs(v - median));
    ASSERT_EQ(window.size(), values.size());
    ASSERT_EQ(static_cast<float>(window.median()), median);
    ASSERT_EQ(static_cast<float>(window.median_deviation()), upper_median(distance));
  }
}

TEST(SortedWindow, ignores_what_is_not_a_number) {
  SortedWindow<8> window;
  window.push(1.0);
  window.push(std::numeric_limits<double>::quiet_NaN());
  window.push(std::numeric_limits<double>::infinity());
  EXPECT_EQ(window.size(), 1U);
  window.clear();
  EXPECT_EQ(window.size(), 0U);
}

}  // namespace
}  // namespace ftcs::estimation
