// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>

namespace ftcs::estimation {

/// The step of a clock's timestamps: what all their differences are multiples
/// of. A stamp is wrong by up to a step, and where the noise is smaller than
/// that no averaging shows it.
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
