// SPDX-License-Identifier: MIT
#include "ftcs/analysis/statistics.h"

#include <algorithm>
#include <cmath>

namespace ftcs {
namespace {

/// More bins than a plot has columns to show them would only cost space.
constexpr std::size_t kMostBins = 200;

std::vector<double> finite_ascending(std::span<const double> values) {
  std::vector<double> sorted;
  sorted.reserve(values.size());
  std::copy_if(values.begin(), values.end(), std::back_inserter(sorted),
               [](double value) { return std::isfinite(value); });
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

}  // namespace

void RunningStatistics::add(double value) noexcept {
  if (!std::isfinite(value)) {
    ++missing_;
    return;
  }
  ++count_;
  const double distance = value - mean_;
  mean_ += distance / static_cast<double>(count_);
  squares_ += distance * (value - mean_);
  minimum_ = std::min(minimum_, value);
  maximum_ = std::max(maximum_, value);
}

void RunningStatistics::merge(const RunningStatistics& other) noexcept {
  missing_ += other.missing_;
  if (other.count_ == 0) return;
  const auto own = static_cast<double>(count_);
  const auto added = static_cast<double>(other.count_);
  const double distance = other.mean_ - mean_;
  count_ += other.count_;
  mean_ += distance * added / (own + added);
  squares_ += other.squares_ + distance * distance * own * added / (own + added);
  minimum_ = std::min(minimum_, other.minimum_);
  maximum_ = std::max(maximum_, other.maximum_);
}

double RunningStatistics::standard_deviation() const noexcept {
  return count_ > 1 ? std::sqrt(squares_ / static_cast<double>(count_ - 1)) : kNoFigure;
}

double RunningStatistics::rms() const noexcept {
  if (count_ == 0) return kNoFigure;
  return std::sqrt(mean_ * mean_ + squares_ / static_cast<double>(count_));
}

double RunningStatistics::max_absolute() const noexcept {
  return count_ > 0 ? std::max(std::abs(minimum_), std::abs(maximum_)) : kNoFigure;
}

double quantile_of_sorted(std::span<const double> ascending, double fraction) noexcept {
  if (ascending.empty()) return kNoFigure;
  const double position =
      std::clamp(fraction, 0.0, 1.0) * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  if (below + 1 >= ascending.size()) return ascending.back();
  const double share = position - static_cast<double>(below);
  return ascending[below] + share * (ascending[below + 1] - ascending[below]);
}

double upper_median(std::vector<double> values) {
  const auto missing = [](double value) { return !std::isfinite(value); };
  values.erase(std::remove_if(values.begin(), values.end(), missing), values.end());
  if (values.empty()) return kNoFigure;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Summary summarize(std::span<const double> values) {
  Summary summary;
  for (const double value : values) summary.moments.add(value);
  std::vector<double> sorted = finite_ascending(values);
  summary.median = quantile_of_sorted(sorted, 0.50);
  summary.percentile_1 = quantile_of_sorted(sorted, 0.01);
  summary.percentile_5 = quantile_of_sorted(sorted, 0.05);
  summary.percentile_25 = quantile_of_sorted(sorted, 0.25);
  summary.percentile_75 = quantile_of_sorted(sorted, 0.75);
  summary.percentile_95 = quantile_of_sorted(sorted, 0.95);
  summary.percentile_99 = quantile_of_sorted(sorted, 0.99);

  std::vector<double> distances(sorted.size());
  std::transform(sorted.begin(), sorted.end(), distances.begin(),
                 [median = summary.median](double value) { return std::abs(value - median); });
  std::sort(distances.begin(), distances.end());
  summary.median_absolute_deviation = quantile_of_sorted(distances, 0.5);

  for (double& value : sorted) value = std::abs(value);
  std::sort(sorted.begin(), sorted.end());
  summary.absolute_percentile_95 = quantile_of_sorted(sorted, 0.95);
  summary.absolute_percentile_99 = quantile_of_sorted(sorted, 0.99);
  return summary;
}

Histogram histogram(std::span<const double> values, double lower, double upper, std::size_t bins) {
  Histogram result;
  if (bins == 0 || !(lower < upper) || !std::isfinite(upper - lower)) return result;
  result.lower = lower;
  result.upper = upper;
  result.counts.assign(bins, 0);
  const double count = static_cast<double>(bins);
  const double width = upper - lower;
  // In this order whole numbers on the edges of whole bins stay exact. The width may be so small
  // that the quotient is no double.
  const double per_unit = count / width;
  const bool exact = std::isfinite(per_unit);
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    if (value < lower) {
      ++result.below;
    } else if (value > upper) {
      ++result.above;
    } else {
      // The last bin is closed on the right, so that the maximum belongs to it.
      const double along = value - lower;
      const auto bin = static_cast<std::size_t>(exact ? along * per_unit : along / width * count);
      ++result.counts[std::min(bin, bins - 1)];
    }
  }
  return result;
}

Histogram histogram(std::span<const double> values) {
  const std::vector<double> sorted = finite_ascending(values);
  if (sorted.empty()) return {};
  const double lower = sorted.front();
  const double upper = sorted.back();
  if (!(lower < upper)) {
    const double margin = std::max(std::abs(lower) * 1e-6, std::numeric_limits<double>::min());
    return histogram(values, lower - margin, upper + margin, 1);
  }
  const double quartiles = quantile_of_sorted(sorted, 0.75) - quantile_of_sorted(sorted, 0.25);
  const double width = 2.0 * quartiles / std::cbrt(static_cast<double>(sorted.size()));
  const double wanted = width > 0.0 ? std::ceil((upper - lower) / width) : double{kMostBins};
  const auto bins = static_cast<std::size_t>(std::clamp(wanted, 1.0, double{kMostBins}));
  return histogram(values, lower, upper, bins);
}

}  // namespace ftcs
