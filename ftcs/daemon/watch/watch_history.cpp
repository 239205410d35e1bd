// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/watch_history.h"

#include <algorithm>
#include <cmath>

#include "ftcs/analysis/statistics.h"

namespace ftcs::daemon {
namespace {

constexpr std::size_t kMostOffsets = 8192;
constexpr std::size_t kMostRecent = 2048;
constexpr std::size_t kFewest = 16;  // below it a deviation says nothing
constexpr std::size_t kBins = 41;

}  // namespace

void WatchHistory::add(const WatchPoint& point) {
  recent_.push_back(point);
  if (recent_.size() > kMostRecent)
    recent_.erase(recent_.begin(), recent_.begin() + kMostRecent / 4);
  if (!point.used || !point.locked || std::isnan(point.offset_ns)) return;
  if (++skipped_ < every_ && !offsets_s_.empty()) return;
  skipped_ = 0;
  if (offsets_s_.empty()) first_s_ = point.time_s;
  last_s_ = point.time_s;
  offsets_s_.push_back(point.offset_ns * 1e-9);
  if (offsets_s_.size() == kMostOffsets) thin_out();
}

void WatchHistory::thin_out() {
  for (std::size_t i = 0; i < kMostOffsets / 2; ++i) offsets_s_[i] = offsets_s_[2 * i];
  offsets_s_.resize(kMostOffsets / 2);
  const double spacing = (last_s_ - first_s_) / static_cast<double>(kMostOffsets - 1);
  last_s_ -= spacing;
  every_ *= 2;
}

std::vector<StabilityPoint> WatchHistory::deviations(Deviation deviation) const {
  if (offsets_s_.size() < kFewest || last_s_ <= first_s_) return {};
  const double spacing = (last_s_ - first_s_) / static_cast<double>(offsets_s_.size() - 1);
  return stability(deviation, {offsets_s_, spacing}, octave_factors(offsets_s_.size()));
}

WatchHistogram WatchHistory::histogram() const {
  std::vector<double> values;
  for (const WatchPoint& point : recent_) {
    if (point.used && !std::isnan(point.offset_ns)) values.push_back(point.offset_ns);
  }
  if (values.size() < kFewest) return {};
  // All but the farthest in a hundred: a start does not squeeze the rest into one bin.
  constexpr std::size_t kOneIn = 100;
  std::sort(values.begin(), values.end());
  const std::size_t cut = values.size() / kOneIn;
  const double low = values[cut];
  const double high = values[values.size() - 1 - cut];
  WatchHistogram histogram;
  histogram.lowest_ns = low;
  histogram.width_ns = std::max((high - low) / static_cast<double>(kBins), 1e-3);
  histogram.counts.resize(kBins);
  for (const double value : values) {
    const double bin = std::floor((value - low) / histogram.width_ns);
    const double last = static_cast<double>(kBins - 1);
    ++histogram.counts[static_cast<std::size_t>(std::clamp(bin, 0.0, last))];
  }
  return histogram;
}

std::optional<double> WatchHistory::largest_ns() const {
  std::optional<double> largest;
  for (const WatchPoint& point : recent_) {
    if (!point.used || std::isnan(point.offset_ns)) continue;
    largest = std::max(largest.value_or(0.0), std::abs(point.offset_ns));
  }
  return largest;
}

}  // namespace ftcs::daemon
