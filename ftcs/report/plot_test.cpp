// SPDX-License-Identifier: MIT
// World: long traces that have to be thinned without losing what matters.
#include "ftcs/report/plot.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

TEST(Downsample, keeps_a_spike_of_one_sample) {
  std::vector<double> values(1000000, 1.0);
  values[654321] = 99.0;
  values[123456] = -99.0;
  const auto thin = downsample(trace_series("x", values, 0.5, 1.0), 1000);
  EXPECT_LE(thin.y.size(), 2000U);
  const auto largest = std::max_element(thin.y.begin(), thin.y.end());
  EXPECT_EQ(*largest, 99.0);
  EXPECT_EQ(thin.x[static_cast<std::size_t>(largest - thin.y.begin())], 654321 * 0.5);
  EXPECT_EQ(*std::min_element(thin.y.begin(), thin.y.end()), -99.0);
  EXPECT_TRUE(std::is_sorted(thin.x.begin(), thin.x.end()));
}

TEST(Downsample, keeps_a_gap_and_leaves_short_series_alone) {
  std::vector<double> values(1000, 1.0);
  std::fill(values.begin() + 300, values.begin() + 600, kNoFigure);
  const auto thin = downsample(trace_series("x", values, 1.0, 1.0), 100);
  EXPECT_TRUE(std::any_of(thin.y.begin(), thin.y.end(), [](double y) { return std::isnan(y); }));
  EXPECT_EQ(downsample(trace_series("x", values, 1.0, 1.0), 500).y.size(), 1000U);
}

TEST(Series, scale_to_the_unit_of_the_plot) {
  const double seconds[] = {2e-9, -4e-9};
  const auto trace = trace_series("offset", seconds, 0.125, 1e-9);
  EXPECT_NEAR(trace.y[1], -4.0, 1e-12);
  EXPECT_EQ(trace.x[1], 0.125);
}

TEST(Series, of_deviations_leave_out_what_a_logarithm_cannot_show) {
  StabilityPoint zero;
  StabilityPoint single;
  single.tau_s = 8.0;
  single.deviation = 1e-9;
  single.lower = kNoFigure;
  single.upper = kNoFigure;
  const StabilityPoint points[] = {zero, single};
  const auto series = deviation_series("OADEV", points);
  ASSERT_EQ(series.x.size(), 1U);
  EXPECT_EQ(series.lower[0], 1e-9);
}

TEST(Series, of_a_histogram_end_at_zero) {
  const double values[] = {0.0, 1.0, 1.0, 2.0};
  const auto series = histogram_series("n", histogram(values, 0.0, 2.0, 2), 1.0);
  EXPECT_EQ(series.x, (std::vector<double>{0.0, 1.0, 2.0}));
  EXPECT_EQ(series.y, (std::vector<double>{1.0, 3.0, 0.0}));
}

}  // namespace
}  // namespace ftcs
