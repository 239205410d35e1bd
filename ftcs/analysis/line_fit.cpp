// SPDX-License-Identifier: MIT
#include "ftcs/analysis/line_fit.h"

#include <cmath>
#include <cstddef>
#include <vector>

namespace ftcs {

LineFit fit_line(std::span<const double> values, std::span<const double> places) {
  RunningStatistics where;
  RunningStatistics heights;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    where.add(places[i]);
    heights.add(values[i]);
  }
  double squares = 0.0;
  double products = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    const double distance = places[i] - where.mean();
    squares += distance * distance;
    products += distance * (values[i] - heights.mean());
  }
  LineFit fit;
  if (!(squares > 0.0)) return fit;
  fit.slope = products / squares;
  fit.intercept = heights.mean() - fit.slope * where.mean();
  RunningStatistics residuals;
  for (std::size_t i = 0; i < values.size(); ++i)
    residuals.add(values[i] - heights.mean() - fit.slope * (places[i] - where.mean()));
  fit.residual_rms = residuals.rms();
  fit.slope_deviation = fit.residual_rms / std::sqrt(squares);
  return fit;
}

LineFit fit_line(std::span<const double> values, double interval_s) {
  std::vector<double> places(values.size());
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<double>(i);
  LineFit fit = fit_line(values, places);
  fit.slope /= interval_s;
  fit.slope_deviation /= interval_s;
  return fit;
}

}  // namespace ftcs
