// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/run_histograms.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace ftcs::daemon {

namespace {
constexpr std::size_t kBins = 60;
constexpr double kShownQuantile = 0.999;
}  // namespace

Histogram run_histogram(const experiment::CycleFigures& figures,
                        float experiment::CyclePoint::*field) {
  std::vector<double> values;
  values.reserve(figures.trace.size());
  for (const experiment::CyclePoint& point : figures.trace) {
    values.push_back(static_cast<double>(point.*field));
  }
  std::sort(values.begin(), values.end());
  const double lower = quantile_of_sorted(values, 1.0 - kShownQuantile);
  const double upper = quantile_of_sorted(values, kShownQuantile);
  if (!(lower < upper)) return {};
  return histogram(values, lower, upper, kBins);
}

std::string histogram_bars(const Histogram& histogram) {
  static constexpr std::array<const char*, 9> kHeights{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  if (histogram.counts.empty()) return {};
  const auto most = static_cast<double>(std::max<std::uint64_t>(
      1, *std::max_element(histogram.counts.begin(), histogram.counts.end())));
  std::string bars;
  for (const std::uint64_t count : histogram.counts) {
    // Whatever is not empty is seen.
    constexpr double kHighest = 8.0;
    const auto height = std::ceil(static_cast<double>(count) / most * kHighest);
    bars += kHeights[static_cast<std::size_t>(height)];
  }
  return bars;
}

}  // namespace ftcs::daemon
