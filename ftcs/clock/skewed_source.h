// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/clock/affine_map.h"

namespace ftcs {

/// An oscillator with a known rate error, made of one without: free running = start + rate
/// (underlying - start).
///
/// For laboratory and demonstration. Whoever steers a clock on it sees this source alone and cannot
/// know the skew; stamps that were taken on the underlying oscillator (a socket's) are brought over
/// by from_underlying().
class SkewedSource final : public FreeRunningSource {
 public:
  /// At `start` both oscillators show the same.
  SkewedSource(FreeRunningSource& underlying, Rate rate, FreeRunningTime start) noexcept
      : underlying_(underlying), map_(start, start, rate) {}

  [[nodiscard]] FreeRunningTime now() noexcept override { return map_(underlying_.now()); }
  /// What this source showed when the underlying one showed `instant`; to_underlying() is its
  /// inverse, to 2^-32 ns.
  [[nodiscard]] FreeRunningTime from_underlying(FreeRunningTime instant) const noexcept {
    return map_(instant);
  }
  [[nodiscard]] Rate rate() const noexcept { return map_.rate(); }
  [[nodiscard]] FreeRunningTime to_underlying(FreeRunningTime instant) const noexcept {
    return map_.inverse(instant);
  }

 private:
  FreeRunningSource& underlying_;
  AffineMap<FreeRunningTime, FreeRunningTime> map_;
};

}  // namespace ftcs
