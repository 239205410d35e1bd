// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>

#include "ftcs/estimation/elementary.h"

namespace ftcs::estimation {

/// The step of a clock's timestamps: what all their differences are multiples
/// of. A stamp is wrong by up to a step. Noise of sigma makes of that an error
/// that averaging removes, but for the part whose first harmonic
///
///     exp(-2 pi^2 sigma^2 / q^2)       q the step
///
/// is left of (Widrow's condition, W. Widrow and I. Kollar, Quantization Noise,
/// 2008): with a third of a step a hundredth, with none all.
///
/// Stamps of a nanosecond or less are taken for exact. So are steps above
/// `kCoarsest`: they are the schedule of messages that leave on time, not the
/// clock. Messages more than four seconds apart tell nothing here.
class TickMeter {
 public:
  void observe(std::uint64_t difference_ns) noexcept {
    if (step_ns_ == 1 || difference_ns > std::numeric_limits<std::uint32_t>::max()) return;
    const auto difference = static_cast<std::uint32_t>(difference_ns);
    if (step_ns_ == 0 || difference % step_ns_ != 0) step_ns_ = std::gcd(step_ns_, difference);
  }
  /// Variance of an error spread evenly over a step, ns^2.
  [[nodiscard]] double variance_ns2() const noexcept {
    return step_ns_ <= 1 || step_ns_ > kCoarsest ? 0.0 : even(step_ns_);
  }
  /// What noise of so much beside the rounding, ns^2 >= 0, leaves of it for no
  /// averaging to show, ns^2: at most q^2 / 12 exp(-4 pi^2 sigma^2 / q^2).
  [[nodiscard]] double hidden_ns2(double noise_ns2) const noexcept {
    const double variance = variance_ns2();
    constexpr double kPiSquared = std::numbers::pi * std::numbers::pi;
    if (variance == 0.0) return 0.0;
    return variance * portable_exp(-4.0 * kPiSquared * noise_ns2 / (12.0 * variance));
  }
  /// The same with a step of one nanosecond at least.
  [[nodiscard]] double rounding_ns2() const noexcept { return std::max(variance_ns2(), even(1)); }

 private:
  [[nodiscard]] static double even(std::uint32_t step_ns) noexcept {
    const double step = step_ns;
    return step * step / 12.0;
  }
  static constexpr std::uint32_t kCoarsest = 20'000;
  std::uint32_t step_ns_ = 0;  ///< greatest common divisor; 0: no difference yet
};

}  // namespace ftcs::estimation
