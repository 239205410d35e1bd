// SPDX-License-Identifier: MIT
// World: values on a known straight line, with gaps or with scatter.
#include "ftcs/analysis/line_fit.h"

#include <cmath>

#include <gtest/gtest.h>

#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

TEST(FitLine, finds_offset_and_slope_between_gaps) {
  std::vector<double> values(100);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 5.0 - 0.25 * static_cast<double>(i);
  values[10] = values[50] = kNoFigure;
  const LineFit fit = fit_line(values, 0.5);
  EXPECT_NEAR(fit.intercept, 5.0, 1e-12);
  EXPECT_NEAR(fit.slope, -0.5, 1e-12);
  EXPECT_NEAR(fit.residual_rms, 0.0, 1e-12);
}

TEST(FitLine, of_one_value_has_no_slope) {
  const double one[] = {kNoFigure, 1.0};
  EXPECT_TRUE(std::isnan(fit_line(one, 1.0).slope));
  EXPECT_TRUE(std::isnan(fit_line({}, 1.0).slope));
}

TEST(FitLine, takes_places_that_are_not_equally_spaced) {
  const double places[] = {0.0, 1.0, 4.0, 10.0};
  const double values[] = {3.0, 5.0, 11.0, 23.0};
  const LineFit fit = fit_line(values, places);
  EXPECT_NEAR(fit.intercept, 3.0, 1e-12);
  EXPECT_NEAR(fit.slope, 2.0, 1e-12);
}

TEST(FitLine, states_the_deviation_of_its_slope) {
  RunningStatistics slopes;
  double stated = 0.0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto values = test::white_noise(50, 1.0, seed);
    const LineFit fit = fit_line(values, 0.5);
    slopes.add(fit.slope);
    stated += fit.slope_deviation / 200.0;
  }
  EXPECT_NEAR(stated / slopes.standard_deviation(), 1.0, 0.15);
}

TEST(FitLine, of_values_at_one_place_has_no_slope) {
  const double places[] = {1.0, 1.0};
  const double values[] = {3.0, 5.0};
  EXPECT_TRUE(std::isnan(fit_line(values, places).slope));
}

}  // namespace
}  // namespace ftcs
