// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace ftcs {

/// A figure that cannot be given (no data, too few points): printed as a gap, null in JSON.
inline constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

/// Mean, deviation and extremes of a stream in constant memory.
///
/// Welford's recurrence (B. P. Welford, Technometrics 4, 1962): mean_n = mean_(n-1) + (x -
/// mean_(n-1))/n, M2_n = M2_(n-1) + (x - mean_(n-1))(x - mean_n). No cancellation when the mean is
/// large against the spread. A value that is not finite is counted as missing and changes nothing
/// else.
class RunningStatistics {
 public:
  void add(double value) noexcept;
  /// As if every value of `other` had been added here (Chan, Golub, LeVeque 1979, pairwise update).
  void merge(const RunningStatistics& other) noexcept;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }
  [[nodiscard]] double mean() const noexcept { return count_ > 0 ? mean_ : kNoFigure; }
  /// Sample standard deviation, divisor n - 1; no figure below two values.
  [[nodiscard]] double standard_deviation() const noexcept;
  /// sqrt(sum x^2 / n): about zero, not about the mean.
  [[nodiscard]] double rms() const noexcept;
  [[nodiscard]] double minimum() const noexcept { return count_ > 0 ? minimum_ : kNoFigure; }
  [[nodiscard]] double maximum() const noexcept { return count_ > 0 ? maximum_ : kNoFigure; }
  /// max |x|; of time errors it is max |TE| (ITU-T G.8260, 3.1.20).
  [[nodiscard]] double max_absolute() const noexcept;

 private:
  std::uint64_t count_ = 0;
  std::uint64_t missing_ = 0;
  double mean_ = 0.0;
  double squares_ = 0.0;  // M2: sum of squared distances from the mean
  double minimum_ = std::numeric_limits<double>::infinity();
  double maximum_ = -std::numeric_limits<double>::infinity();
};

/// Quantile of ascending values by linear interpolation between order statistics (Hyndman & Fan
/// 1996, type 7; the default of R and numpy). 0 <= fraction <= 1. No values: no figure.
[[nodiscard]] double quantile_of_sorted(std::span<const double> ascending,
                                        double fraction) noexcept;

/// The upper of the two middle values: one that occurs, for what is counted or rounded. Values that
/// are not finite are left out; none: no figure.
[[nodiscard]] double upper_median(std::vector<double> values);

/// Figures that need all values at once.
struct Summary {
  RunningStatistics moments;
  double median = kNoFigure;
  /// Median of |x - median|, unscaled; 1.4826 times it estimates sigma of a normal distribution.
  double median_absolute_deviation = kNoFigure;
  double percentile_1 = kNoFigure;
  double percentile_5 = kNoFigure;
  double percentile_25 = kNoFigure;
  double percentile_75 = kNoFigure;
  double percentile_95 = kNoFigure;
  double percentile_99 = kNoFigure;
  /// 95 % and 99 % of |x|.
  double absolute_percentile_95 = kNoFigure;
  double absolute_percentile_99 = kNoFigure;
};

/// Values that are not finite are counted as missing and otherwise ignored. O(n log n), copies the
/// values.
[[nodiscard]] Summary summarize(std::span<const double> values);

/// Equal bins over [lower, upper]; what lies outside is counted, not dropped.
struct Histogram {
  double lower = 0.0;
  double upper = 0.0;
  std::vector<std::uint64_t> counts;
  std::uint64_t below = 0;
  std::uint64_t above = 0;

  [[nodiscard]] double bin_width() const noexcept {
    return counts.empty() ? 0.0 : (upper - lower) / static_cast<double>(counts.size());
  }
};

/// bins > 0, lower < upper, both finite; otherwise the histogram is empty.
[[nodiscard]] Histogram histogram(std::span<const double> values, double lower, double upper,
                                  std::size_t bins);
/// Chooses range and bins itself: Freedman-Diaconis width 2 IQR n^(-1/3) (1981) over the whole
/// range, at most 200 bins; a constant record gets one bin.
[[nodiscard]] Histogram histogram(std::span<const double> values);

}  // namespace ftcs
