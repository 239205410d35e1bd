// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ftcs/analysis/mtie.h"
#include "ftcs/analysis/stability.h"
#include "ftcs/analysis/statistics.h"

namespace ftcs {

/// x ascending; a y that is not finite is a gap in the line. lower and upper (a band around y) are
/// empty or as long as y.
struct PlotSeries {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> lower;
  std::vector<double> upper;
};

enum class PlotStyle : std::uint8_t {
  kLine,
  kLineWithPoints,
  kFilledSteps,  ///< a histogram
};

struct Plot {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool log_x = false;
  bool log_y = false;
  PlotStyle style = PlotStyle::kLine;
  std::vector<PlotSeries> series;
  std::string note;       ///< a sentence under the plot
  double y_extent = 0.0;  ///< the picture begins with y from -y_extent to y_extent; 0: all of it
};

/// At most two points for each of `buckets` equal runs of points: its smallest and its largest y,
/// in the order in which they came, so that the shortest spike stays visible. A run that holds only
/// gaps gives one gap. Short series come back unchanged.
[[nodiscard]] PlotSeries downsample(const PlotSeries& series, std::size_t buckets);

/// y = `values` / `unit`, x = index times interval.
[[nodiscard]] PlotSeries trace_series(std::string name, std::span<const double> values,
                                      double interval, double unit);
[[nodiscard]] PlotSeries deviation_series(std::string name, std::span<const StabilityPoint> points);
[[nodiscard]] PlotSeries mtie_series(std::string name, std::span<const MtiePoint> points);
/// Steps at the left edges of the bins and a zero at the end.
[[nodiscard]] PlotSeries histogram_series(std::string name, const Histogram& histogram,
                                          double unit);

}  // namespace ftcs
