// SPDX-License-Identifier: MIT
// World: short records whose figures can be worked out by hand, and one long one against the
// two-pass formulas.
#include "ftcs/analysis/statistics.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

TEST(RunningStatistics, knows_mean_deviation_rms_and_extremes) {
  RunningStatistics statistics;
  for (const double value : {2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, -9.0}) statistics.add(value);
  EXPECT_EQ(statistics.count(), 8U);
  EXPECT_DOUBLE_EQ(statistics.mean(), 2.75);
  EXPECT_NEAR(statistics.standard_deviation(), std::sqrt((232.0 - 8 * 2.75 * 2.75) / 7.0), 1e-12);
  EXPECT_NEAR(statistics.rms(), std::sqrt(232.0 / 8.0), 1e-12);
  EXPECT_EQ(statistics.minimum(), -9.0);
  EXPECT_EQ(statistics.maximum(), 7.0);
  EXPECT_EQ(statistics.max_absolute(), 9.0);
}

TEST(RunningStatistics, gives_no_figure_without_values) {
  const RunningStatistics statistics;
  EXPECT_TRUE(std::isnan(statistics.mean()));
  EXPECT_TRUE(std::isnan(statistics.rms()));
  EXPECT_TRUE(std::isnan(statistics.maximum()));
  EXPECT_TRUE(std::isnan(statistics.standard_deviation()));
}

TEST(RunningStatistics, counts_what_is_not_finite_as_missing) {
  RunningStatistics statistics;
  statistics.add(1.0);
  statistics.add(std::numeric_limits<double>::quiet_NaN());
  statistics.add(std::numeric_limits<double>::infinity());
  EXPECT_EQ(statistics.count(), 1U);
  EXPECT_EQ(statistics.missing(), 2U);
  EXPECT_EQ(statistics.maximum(), 1.0);
}

TEST(RunningStatistics, does_not_lose_a_small_spread_on_a_large_mean) {
  RunningStatistics statistics;
  for (int i = 0; i < 1000; ++i) statistics.add(1e9 + (i % 2 == 0 ? 1e-3 : -1e-3));
  EXPECT_NEAR(statistics.standard_deviation(), 1e-3, 1e-5);
}

TEST(UpperMedian, is_a_value_that_occurs) {
  EXPECT_EQ(upper_median({4.0, 1.0, kNoFigure, 3.0, 2.0}), 3.0);
  EXPECT_EQ(upper_median({2.0, 9.0, 1.0}), 2.0);
  EXPECT_TRUE(std::isnan(upper_median({kNoFigure})));
}

TEST(RunningStatistics, merged_parts_equal_the_whole) {
  const auto values = test::white_noise(1000, 3.0, 1);
  RunningStatistics whole;
  RunningStatistics first;
  RunningStatistics second;
  for (std::size_t i = 0; i < values.size(); ++i) {
    whole.add(values[i]);
    (i < 300 ? first : second).add(values[i]);
  }
  first.merge(second);
  EXPECT_EQ(first.count(), whole.count());
  EXPECT_NEAR(first.mean(), whole.mean(), 1e-12);
  EXPECT_NEAR(first.standard_deviation(), whole.standard_deviation(), 1e-12);
  RunningStatistics empty;
  empty.merge(whole);
  EXPECT_NEAR(empty.rms(), whole.rms(), 1e-12);
}

TEST(Quantile, interpolates_between_order_statistics) {
  const double values[] = {1.0, 2.0, 4.0, 8.0};
  EXPECT_EQ(quantile_of_sorted(values, 0.0), 1.0);
  EXPECT_EQ(quantile_of_sorted(values, 1.0), 8.0);
  EXPECT_DOUBLE_EQ(quantile_of_sorted(values, 0.5), 3.0);
  EXPECT_DOUBLE_EQ(quantile_of_sorted(values, 0.25), 1.75);
  EXPECT_TRUE(std::isnan(quantile_of_sorted({}, 0.5)));
}

TEST(Summary, resists_one_outlier_in_median_and_mad) {
  const double values[] = {1.0, 2.0, 3.0, 4.0, -1e9};
  const Summary summary = summarize(values);
  EXPECT_EQ(summary.median, 2.0);
  EXPECT_EQ(summary.median_absolute_deviation, 1.0);
  EXPECT_GT(summary.absolute_percentile_99, 9e8);
}

TEST(Summary, of_normal_noise_has_the_normal_percentiles) {
  const auto values = test::white_noise(100000, 1.0, 2);
  const Summary summary = summarize(values);
  EXPECT_NEAR(summary.percentile_95, 1.6449, 0.03);
  EXPECT_NEAR(summary.percentile_5, -1.6449, 0.03);
  EXPECT_NEAR(summary.absolute_percentile_95, 1.9600, 0.03);
  EXPECT_NEAR(1.4826 * summary.median_absolute_deviation, 1.0, 0.02);
}

TEST(Histogram, counts_every_value_once_and_the_rest_outside) {
  const double values[] = {0.0, 0.5, 1.0, 1.5, 2.0, -1.0, 3.0, kNoFigure};
  const Histogram bins = histogram(values, 0.0, 2.0, 2);
  ASSERT_EQ(bins.counts.size(), 2U);
  EXPECT_EQ(bins.counts[0], 2U);  // 0 and 0.5
  EXPECT_EQ(bins.counts[1], 3U);  // 1, 1.5 and the closed right end
  EXPECT_EQ(bins.below, 1U);
  EXPECT_EQ(bins.above, 1U);
  EXPECT_EQ(bins.bin_width(), 1.0);
}

TEST(Histogram, chooses_a_range_that_holds_everything) {
  const auto values = test::white_noise(10000, 1.0, 3);
  const Histogram bins = histogram(values);
  std::uint64_t sum = 0;
  for (const auto count : bins.counts) sum += count;
  EXPECT_EQ(sum, values.size());
  EXPECT_GT(bins.counts.size(), 20U);
  EXPECT_LE(bins.counts.size(), 200U);
}

TEST(Histogram, of_whole_numbers_in_bins_of_whole_numbers_has_no_gaps) {
  for (std::size_t bins = 1; bins <= 200; ++bins) {
    for (const double width : {1.0, 2.0, 5.0, 8.0}) {
      std::vector<double> edges;
      for (std::size_t k = 0; k < bins; ++k) edges.push_back(width * static_cast<double>(k));
      const double upper = width * static_cast<double>(bins);
      EXPECT_EQ(histogram(edges, 0.0, upper, bins).counts, std::vector<std::uint64_t>(bins, 1))
          << bins << " bins of " << width;
    }
  }
}

TEST(Histogram, of_values_a_denormal_apart_is_defined) {
  constexpr double kSmall = 3e-321;  // its reciprocal is not a double
  const double values[] = {0.0, kSmall / 2, kSmall};
  const Histogram bins = histogram(values, 0.0, kSmall, 2);
  EXPECT_EQ(bins.counts, (std::vector<std::uint64_t>{1, 2}));
}

TEST(Histogram, of_a_constant_or_of_nothing_is_defined) {
  const double constant[] = {5.0, 5.0};
  EXPECT_EQ(histogram(constant).counts, std::vector<std::uint64_t>{2});
  const double zeros[] = {0.0};
  EXPECT_EQ(histogram(zeros).counts, std::vector<std::uint64_t>{1});
  EXPECT_TRUE(histogram({}).counts.empty());
  EXPECT_TRUE(histogram(constant, 2.0, 1.0, 4).counts.empty());
}

}  // namespace
}  // namespace ftcs
