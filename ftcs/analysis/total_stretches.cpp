// SPDX-License-Identifier: MIT
#include "ftcs/analysis/total_stretches.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "ftcs/analysis/stability.h"

namespace ftcs {
namespace {

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Slope per place between the means of both halves; the middle one of an odd number is left out.
double half_average_slope(std::span<const double> stretch) {
  const std::size_t half = stretch.size() / 2;
  const std::size_t apart = stretch.size() - half;
  return (mean(stretch.subspan(apart)) - mean(stretch.first(half))) / static_cast<double>(apart);
}

/// One term; `sums` is room for 9m + 1 values.
double term(std::span<const double> stretch, std::size_t m, std::vector<double>& sums) {
  const double slope = half_average_slope(stretch);
  const double first = stretch.front();  // keeps the sums small
  const std::size_t length = stretch.size();
  const auto level = [&](std::size_t i) {
    return stretch[i] - first - slope * static_cast<double>(i);
  };
  sums[0] = 0.0;
  for (std::size_t i = 0; i < 3 * length; ++i) {
    const std::size_t within = i % length;
    const bool middle = i / length == 1;
    sums[i + 1] = sums[i] + level(middle ? within : length - 1 - within);
  }
  double squares = 0.0;
  const double width = static_cast<double>(m);
  for (std::size_t j = 0; j < 6 * m; ++j) {
    const double second = (sums[j + 3 * m] - sums[j + 2 * m]) -
                          2.0 * (sums[j + 2 * m] - sums[j + m]) + (sums[j + m] - sums[j]);
    squares += second * second / (width * width);
  }
  return std::sqrt(squares / static_cast<double>(6 * m));
}

}  // namespace

std::size_t stretch_stride(std::size_t values, std::size_t m) noexcept {
  const double all = static_cast<double>(values) * static_cast<double>(m);
  constexpr std::size_t kStretchesPerTau = 16;
  return all <= kMostExactTotal ? 1 : std::max<std::size_t>(m / kStretchesPerTau, 1);
}

MeanSquare total_of_stretches(std::span<const double> values, std::size_t m) {
  MeanSquare square;
  std::vector<double> sums(9 * m + 1);
  const std::size_t stride = stretch_stride(values.size(), m);
  for (std::size_t i = 0; i + 3 * m <= values.size(); i += stride)
    square.add(term(values.subspan(i, 3 * m), m, sums));
  return square;
}

}  // namespace ftcs
