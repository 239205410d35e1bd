// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "ftcs/analysis/statistics.h"

namespace ftcs {

/// The straight line y = intercept + slope x by least squares.
struct LineFit {
  double intercept = kNoFigure;  ///< at x = 0
  double slope = kNoFigure;      ///< in units of y per unit of x
  double residual_rms = kNoFigure;
  /// Standard deviation of the slope: residual RMS / sqrt(sum (x - mean x)^2), which takes the
  /// residuals for white.
  double slope_deviation = kNoFigure;
};

/// As many places as values; values that are not finite are left out. Fewer than two values, or all
/// at one place: no figures.
[[nodiscard]] LineFit fit_line(std::span<const double> values, std::span<const double> places);

/// Equally spaced values: the first at 0 s. interval_s > 0.
[[nodiscard]] LineFit fit_line(std::span<const double> values, double interval_s);

}  // namespace ftcs
