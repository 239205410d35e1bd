// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ftcs/time/rate.h"

namespace ftcs::platform {

/// The rate that a clock is to be left at when nobody steers it any more.
///
/// A servo's latest rate has the noise of its latest sample: readings in whole nanoseconds, eight a
/// second, are 8 ppb of it, which after an hour are 30 us. So rates are averaged over two seconds:
///
///     kept <- kept + (rate - kept) min(dt / 2 s, 1)
///
/// A rate that is 50 ppb and more from the average is no noise and replaces it.
class KeptRate {
 public:
  /// `first`: for as long as no rate has proved itself.
  explicit KeptRate(Rate first) noexcept : kept_(first.ratio()) {}

  /// A rate with which the servo is locked; `raw_ns` in order.
  void note(Rate rate, std::int64_t raw_ns) noexcept {
    const double elapsed = has_rate_ ? static_cast<double>(raw_ns - noted_ns_) : 0.0;
    const double difference = rate.ratio() - kept_;
    const bool is_noise = has_rate_ && std::abs(difference) < kLargestNoise;
    kept_ = is_noise ? kept_ + difference * std::min(elapsed / kAveragingNs, 1.0) : rate.ratio();
    has_rate_ = true;
    noted_ns_ = raw_ns;
  }
  [[nodiscard]] Rate rate() const noexcept { return Rate::from_ratio(kept_); }

 private:
  static constexpr double kLargestNoise = 50e-9;
  static constexpr double kAveragingNs = 2e9;

  double kept_;
  bool has_rate_ = false;
  std::int64_t noted_ns_ = 0;
};

}  // namespace ftcs::platform
