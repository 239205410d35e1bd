// SPDX-License-Identifier: MIT
#include "ftcs/report/plot.h"

#include <algorithm>
#include <cmath>

namespace ftcs {

PlotSeries downsample(const PlotSeries& series, std::size_t buckets) {
  const std::size_t count = std::min(series.x.size(), series.y.size());
  if (buckets == 0 || count <= 2 * buckets) return series;
  PlotSeries result;
  result.name = series.name;
  for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
    const std::size_t begin = bucket * count / buckets;
    const std::size_t end = (bucket + 1) * count / buckets;
    std::size_t smallest = end;
    std::size_t largest = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (!std::isfinite(series.y[i])) continue;
      if (smallest == end || series.y[i] < series.y[smallest]) smallest = i;
      if (largest == end || series.y[i] > series.y[largest]) largest = i;
    }
    if (smallest == end) {
      result.x.push_back(series.x[begin]);
      result.y.push_back(kNoFigure);
      continue;
    }
    const std::size_t first = std::min(smallest, largest);
    const std::size_t second = std::max(smallest, largest);
    result.x.push_back(series.x[first]);
    result.y.push_back(series.y[first]);
    if (second != first) {
      result.x.push_back(series.x[second]);
      result.y.push_back(series.y[second]);
    }
  }
  return result;
}

PlotSeries trace_series(std::string name, std::span<const double> values, double interval,
                        double unit) {
  PlotSeries series;
  series.name = std::move(name);
  series.x.reserve(values.size());
  series.y.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    series.x.push_back(static_cast<double>(i) * interval);
    series.y.push_back(values[i] / unit);
  }
  return series;
}

PlotSeries deviation_series(std::string name, std::span<const StabilityPoint> points) {
  PlotSeries series;
  series.name = std::move(name);
  for (const StabilityPoint& point : points) {
    // A logarithmic axis has no place for the deviation of a perfect clock.
    if (!(point.deviation > 0.0)) continue;
    series.x.push_back(point.tau_s);
    series.y.push_back(point.deviation);
    const bool known = point.lower > 0.0 && std::isfinite(point.upper);
    series.lower.push_back(known ? point.lower : point.deviation);
    series.upper.push_back(known ? point.upper : point.deviation);
  }
  return series;
}

PlotSeries mtie_series(std::string name, std::span<const MtiePoint> points) {
  PlotSeries series;
  series.name = std::move(name);
  for (const MtiePoint& point : points) {
    if (!(point.mtie_s > 0.0)) continue;
    series.x.push_back(point.tau_s);
    series.y.push_back(point.mtie_s);
  }
  return series;
}

PlotSeries histogram_series(std::string name, const Histogram& histogram, double unit) {
  PlotSeries series;
  series.name = std::move(name);
  for (std::size_t bin = 0; bin < histogram.counts.size(); ++bin) {
    series.x.push_back((histogram.lower + static_cast<double>(bin) * histogram.bin_width()) / unit);
    series.y.push_back(static_cast<double>(histogram.counts[bin]));
  }
  if (!series.x.empty()) {
    series.x.push_back(histogram.upper / unit);
    series.y.push_back(0.0);
  }
  return series;
}

}  // namespace ftcs
