// SPDX-License-Identifier: MIT
#pragma once

#include <compare>
#include <optional>

#include "ftcs/time/duration.h"

namespace ftcs {

/// The rate of one clock in units of another: dimensionless, exactly 1 when both run alike.
///
/// Rates compose by multiplication (paper eq. 8, 13, 17); parts per billion exist only in the names
/// of constructors and getters, because adding them is a first-order approximation (decision 0003).
///
///     Rate::from_ppm(50) * Rate::from_ppm(-50)    // 1 - 2.5e-9: not quite 1, and rightly so
///
/// Any double is taken; whoever commands a clock keeps it within RateLimits. Resolution 2^-53 near
/// 1, which is 1e-7 ppb.
class Rate {
 public:
  constexpr Rate() noexcept = default;
  [[nodiscard]] static constexpr Rate from_ratio(double ratio) noexcept { return Rate{ratio}; }
  [[nodiscard]] static constexpr Rate from_ppb(double ppb) noexcept {
    return Rate{1.0 + ppb * 1e-9};
  }
  [[nodiscard]] static constexpr Rate from_ppm(double ppm) noexcept {
    return Rate{1.0 + ppm * 1e-6};
  }

  /// Seconds of the one clock for each second of the other.
  [[nodiscard]] constexpr double ratio() const noexcept { return ratio_; }
  /// Fractional frequency deviation y = ratio - 1 (NIST SP 1065, 3.1).
  [[nodiscard]] constexpr double deviation() const noexcept { return ratio_ - 1.0; }
  [[nodiscard]] constexpr double ppb() const noexcept { return (ratio_ - 1.0) * 1e9; }
  [[nodiscard]] constexpr double ppm() const noexcept { return (ratio_ - 1.0) * 1e6; }
  /// The same relation seen from the other clock. Infinite for a ratio of zero.
  [[nodiscard]] constexpr Rate inverse() const noexcept { return Rate{1.0 / ratio_}; }

  friend constexpr Rate operator*(Rate a, Rate b) noexcept { return Rate{a.ratio_ * b.ratio_}; }
  friend constexpr Rate operator/(Rate a, Rate b) noexcept { return Rate{a.ratio_ / b.ratio_}; }
  friend constexpr auto operator<=>(Rate, Rate) noexcept = default;
  friend constexpr bool operator==(Rate, Rate) noexcept = default;

 private:
  constexpr explicit Rate(double ratio) noexcept : ratio_(ratio) {}
  double ratio_ = 1.0;
};

/// elapsed * rate: how far the one clock goes while the other goes `elapsed`. The deviation alone
/// is multiplied in floating point, so that the error is 2^-53 of the *correction*, not of the
/// elapsed time: below 1e-8 ns in an hour at 10 ppm. A rate that is not a number scales as 1.
[[nodiscard]] constexpr Duration scale(Duration elapsed, Rate rate) noexcept {
  return elapsed + Duration::from_ns(elapsed.ns() * rate.deviation());
}

/// Slowest and fastest permitted rate: the paper's F (Table 1), linuxptp's max_frequency. Neither
/// zero nor negative, since a clock must go on; both ends belong to it. Which rate is limited,
/// local per free running or another, is said where the limits are held.
struct RateLimits {
  Rate slowest = Rate::from_ratio(0.5);
  Rate fastest = Rate::from_ratio(1.5);

  /// 1 ± ppb. Valid: 0 <= ppb < 1e9; else valid() is false.
  [[nodiscard]] static constexpr RateLimits symmetric_ppb(double ppb) noexcept {
    return {Rate::from_ppb(-ppb), Rate::from_ppb(ppb)};
  }
  /// Nearest permitted rate; a rate that is not a number becomes the nominal one.
  // On plain doubles: the three-way comparison of Rates costs ten times as much here.
  [[nodiscard]] constexpr Rate clamp(Rate rate) const noexcept {
    if (rate.ratio() != rate.ratio()) rate = Rate{};
    if (rate.ratio() < slowest.ratio()) return slowest;
    return rate.ratio() > fastest.ratio() ? fastest : rate;
  }
  /// False for a rate that is not a number.
  [[nodiscard]] constexpr bool contains(Rate rate) const noexcept {
    return rate.ratio() >= slowest.ratio() && rate.ratio() <= fastest.ratio();
  }
  /// 0 < slowest <= 1 <= fastest < 1e6: the nominal rate is always permitted.
  [[nodiscard]] constexpr bool valid() const noexcept {
    return slowest.ratio() > 0.0 && slowest.ratio() <= 1.0 && fastest.ratio() >= 1.0 &&
           fastest.ratio() < 1e6;
  }
};

/// The narrower of two limits. Of two valid ones the result is valid.
[[nodiscard]] constexpr RateLimits intersect(RateLimits a, RateLimits b) noexcept {
  return {a.slowest > b.slowest ? a.slowest : b.slowest,
          a.fastest < b.fastest ? a.fastest : b.fastest};
}

}  // namespace ftcs
