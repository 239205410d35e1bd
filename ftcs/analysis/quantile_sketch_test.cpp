// SPDX-License-Identifier: MIT
// World: streams whose exact quantiles are found by sorting; the sketch promises 1/128 of the
// magnitude.
#include "ftcs/analysis/quantile_sketch.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "ftcs/analysis/statistics.h"
#include "test/support/forbid_allocation.h"
#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

TEST(QuantileSketch, agrees_with_sorting_within_its_bins) {
  auto values = test::white_noise(20000, 50.0, 7);
  QuantileSketch sketch;
  for (const double value : values) sketch.add(value);
  std::sort(values.begin(), values.end());
  for (const double fraction : {0.0, 0.01, 0.05, 0.25, 0.75, 0.95, 0.99, 1.0}) {
    const double exact = values[static_cast<std::size_t>(std::lround(fraction * 19999.0))];
    EXPECT_NEAR(sketch.quantile(fraction), exact, std::abs(exact) / 128.0) << fraction;
  }
  for (double& value : values) value = std::abs(value);
  std::sort(values.begin(), values.end());
  const double exact = values[static_cast<std::size_t>(std::lround(0.95 * 19999.0))];
  EXPECT_NEAR(sketch.absolute_quantile(0.95), exact, exact / 128.0);
}

TEST(QuantileSketch, keeps_zero_and_magnitudes_outside_its_range_in_order) {
  QuantileSketch sketch;
  for (const double value : {-1e30, 0.0, 1e-300, 1e30, kNoFigure}) sketch.add(value);
  EXPECT_EQ(sketch.count(), 4U);
  EXPECT_LT(sketch.quantile(0.0), -1e9);
  EXPECT_EQ(sketch.quantile(0.5), 0.0);
  EXPECT_GT(sketch.quantile(1.0), 1e9);
  EXPECT_TRUE(std::isnan(QuantileSketch{}.quantile(0.5)));
}

TEST(QuantileSketch, merging_equals_one_stream_exactly) {
  const auto values = test::white_noise(5000, 1.0, 8);
  QuantileSketch whole;
  QuantileSketch even;
  QuantileSketch odd;
  for (std::size_t i = 0; i < values.size(); ++i) {
    whole.add(values[i]);
    (i % 2 == 0 ? even : odd).add(values[i]);
  }
  odd.merge(even);
  for (double fraction = 0.0; fraction <= 1.0; fraction += 0.01) {
    EXPECT_EQ(odd.quantile(fraction), whole.quantile(fraction));
  }
}

TEST(QuantileSketch, does_not_allocate_while_it_counts) {
  QuantileSketch sketch;
  const test::ForbidAllocation guard;
  for (int i = 0; i < 1000; ++i) sketch.add(i * 0.37);
}

}  // namespace
}  // namespace ftcs
