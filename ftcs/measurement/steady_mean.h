// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>

#include "ftcs/measurement/shift_watch.h"

namespace ftcs {

/// Robust mean with long memory of a quantity that is constant for hours and then jumps: the delay
/// of a link. All in ns; no threshold in ns, but for the resolution of stamps.
///
///     m := m + clamp(v - m, -L, L) / (0.68 n),  n = 1, 2, ... 1000   (Huber, Ann. Math. Stat. 35,
///                                     1964, solved step by step: Robbins and Monro, 1951)
///     s: doubled and halved in small steps until half of all |v - m| lie below it (the median
///        deviation; 0.67 sigma of normal noise)
///     L = 1.5 s; beyond 6 s (4 sigma) a value is an outlier and left out
///
/// Where values contradict m (ShiftWatch) it must be started again. Late-only noise (queueing) has
/// a floor near m - 2 s, below which normal noise has a share of its values: where hardly any value
/// lies far below m, though many lie far above, value() is the quantile of 0.02 of the values, near
/// the delay without queueing, which is what a servo needs that follows the earliest messages.
class SteadyMean {
 public:
  /// Values that it can start from.
  static constexpr std::size_t kFewest = 5;

  /// `centre`: median of the newest `values` values, `deviation`: their median distance from it.
  /// What was learnt about the noise is kept: a link that became longer is as noisy as before.
  constexpr void start(double centre, double deviation, double values) noexcept {
    const double upper = 2.0 * deviation_;
    deviation_ =
        started() ? std::clamp(deviation, deviation_, upper) : std::max(deviation, kLeastDeviation);
    if (!started()) seen_ = values;
    count_ = values;
    floor_ += centre - centre_;
    centre_ = centre;
    watch_ = {};
  }
  /// How many of the newest values contradict what is known: start() from those; mostly 0.
  [[nodiscard]] constexpr int add(double value) noexcept {
    count_ = std::min(count_ + 1.0, kMemory);
    seen_ = std::min(seen_ + 1.0, kNoiseMemory);
    const double difference = value - centre_;
    const double distance = difference < 0.0 ? -difference : difference;
    learn_deviation(distance);
    const double limit = kLimit * deviation_;
    const bool outlier = distance > kOutlier * deviation_;
    const ShiftWatch::Value watched{std::clamp(difference / limit, -1.0, 1.0), outlier,
                                    late_.chance(), early_.chance(), correlation()};
    late_.learn(outlier && difference > 0.0);
    early_.learn(outlier && difference < 0.0);
    learn_correlation(difference > 0.0);
    if (!outlier) {
      centre_ += watched.part * limit / (kShareWithinLimit * count_);
      if (watch_.calm()) learn_lateness(difference);
      if (late_only_) learn_floor(value);
    }
    return watch_.add(watched);
  }
  [[nodiscard]] constexpr bool started() const noexcept { return seen_ > 0.0; }
  /// ns; 0 before start().
  [[nodiscard]] constexpr double value() const noexcept {
    return late_only_ ? std::min(floor_, centre_) : centre_;
  }
  /// Values are late or right, hardly ever early: value() is then their floor.
  [[nodiscard]] constexpr bool late_only() const noexcept { return late_only_; }

 private:
  static constexpr double kMemory = 1000.0;
  static constexpr double kNoiseMemory = 300.0;
  static constexpr double kLeastDeviation = 0.25;  ///< ns: stamps may all be alike
  static constexpr double kOutlier = 6.0;          ///< median deviations, as the next two
  static constexpr double kLimit = 1.5;
  static constexpr double kFar = 2.2;
  static constexpr double kShareWithinLimit = 0.68;  ///< of normal noise

  /// Values in a row that are worth one independent one: 1 of white noise, 6 of medians of ten.
  [[nodiscard]] constexpr double correlation() const noexcept {
    return std::clamp(same_side_ / (1.0 - same_side_), 1.0, 10.0);
  }
  constexpr void learn_deviation(double distance) noexcept {
    const double step = 1.0 + 2.0 / seen_;
    deviation_ =
        std::max(distance > deviation_ ? deviation_ * step : deviation_ / step, kLeastDeviation);
  }
  constexpr void learn_correlation(bool late) noexcept {
    same_side_ += ((late == was_late_ ? 1.0 : 0.0) - same_side_) / (seen_ + 10.0);
    was_late_ = late;
  }
  /// Sequential test (Wald 1945) of the share of early ones among the values far from the centre:
  /// 0.03 of late-only noise (0 but for the errors of m and s), 0.3 and more of all other.
  constexpr void learn_lateness(double difference) noexcept {
    constexpr double kEarly = -2.3;  // ln(0.03 / 0.3)
    constexpr double kLate = 0.326;  // ln(0.97 / 0.7)
    constexpr double kSure = 8.0;
    const double far = kFar * deviation_;
    if (difference > far) lateness_ = std::min(lateness_ + kLate, kSure);
    if (difference < -far) lateness_ = std::max(lateness_ + kEarly, -kSure);
    if (lateness_ <= 0.0) late_only_ = false;
    if (late_only_ || lateness_ < kSure) return;
    late_only_ = true;
    floor_ = centre_ - 1.44 * deviation_;  // of one exponential queue; that of two is lower
    floor_count_ = 50.0;
  }
  /// Robbins and Monro's quantile; the density near it is about 1 / (4 s).
  constexpr void learn_floor(double value) noexcept {
    constexpr double kShare = 0.02;
    floor_count_ = std::min(floor_count_ + 1.0, kMemory);
    floor_ += 4.0 * deviation_ / floor_count_ * (kShare - (value < floor_ ? 1.0 : 0.0));
  }

  ShiftWatch watch_;
  OutlierChance late_;
  OutlierChance early_;
  double centre_ = 0.0;
  double deviation_ = 0.0;
  double count_ = 0.0;
  double seen_ = 0.0;       ///< values since the first start
  double same_side_ = 0.5;  ///< share of values on the same side as the one before
  bool was_late_ = false;
  double lateness_ = 0.0;  ///< ln likelihood
  bool late_only_ = false;
  double floor_ = 0.0;
  double floor_count_ = 0.0;
};

}  // namespace ftcs
