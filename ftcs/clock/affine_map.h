// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/clock/wide.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs {

/// A rate that can be multiplied without rounding: floor(ratio * 2^53), 0 < ratio < 2^10.
///
/// A double between 1/2 and 2 has no digit below 2^-53, so that every rate a clock meets in
/// practice is held exactly; a slower one is cut off there. Anything outside kLimits is pulled to
/// the nearer end, not-a-number to 1.
class FixedRate {
 public:
  static constexpr int kFractionBits = 53;
  static constexpr RateLimits kLimits{Rate::from_ratio(1.0 / 1024.0), Rate::from_ratio(1023.0)};

  constexpr FixedRate() noexcept = default;
  constexpr explicit FixedRate(Rate rate) noexcept
      : scaled_(static_cast<std::uint64_t>(kLimits.clamp(rate).ratio() * kUnit)) {}

  [[nodiscard]] constexpr std::uint64_t scaled() const noexcept { return scaled_; }
  [[nodiscard]] constexpr Rate rate() const noexcept {
    return Rate::from_ratio(static_cast<double>(scaled_) / kUnit);
  }

 private:
  static constexpr double kUnit = 9007199254740992.0;  // 2^53

  std::uint64_t scaled_ = std::uint64_t{1} << kFractionBits;
};

/// The affine translation between two clocks, paper eq. (8):
///   to = to_base + rate (from - from_base),   rate = a_to / a_from.
///
/// Evaluated in integers without any rounding; only the result is cut down to 2^-32 ns. What is cut
/// off is kept when the map is continued under another rate, so that a clock that is steered 10^9
/// times has no drift of its own. Elapsed times are differences modulo 2^64 ns: a counter that
/// wraps is harmless.
///
///     const AffineMap<FreeRunningTime, LocalTime> shown{f0, l0, Rate::from_ppm(50.0)};
///     shown(f0 + Nanoseconds{1'000'000'000});   // l0 + 1'000'050'000 ns
///
/// Valid: images within ±292 years of to_base; beyond that they wrap.
template <class From, class To>
class AffineMap {
 public:
  AffineMap() noexcept = default;
  AffineMap(From from_base, To to_base, Rate rate) noexcept
      : AffineMap(from_base, to_base, 0, FixedRate{rate}) {}

  [[nodiscard]] From from_base() const noexcept { return from_base_; }
  [[nodiscard]] To to_base() const noexcept { return to_base_; }
  [[nodiscard]] Rate rate() const noexcept { return rate_.rate(); }

  /// The image of an instant, rounded down to 2^-32 ns.
  [[nodiscard]] To operator()(From instant) const noexcept { return evaluate(instant).to; }

  /// The instant whose image is `image`, to 2^-32 ns of both clocks.
  [[nodiscard]] From inverse(To image) const noexcept {
    const Rate back = rate().inverse();
    const From guess = from_base_ + scale(image - to_base_, back);
    // The guess is off by 2^-53 of the time elapsed; its own image tells by how much.
    return guess + scale(image - (*this)(guess), back);
  }

  /// The same line up to `instant`, from there on at another rate: continuous, nothing is lost.
  [[nodiscard]] AffineMap continued(From instant, Rate next) const noexcept {
    const Position at = evaluate(instant);
    return AffineMap{instant, at.to, at.residue, FixedRate{next}};
  }
  /// The same line, moved by `step`.
  [[nodiscard]] AffineMap stepped(Duration step) const noexcept {
    return AffineMap{from_base_, to_base_ + step, residue_, rate_};
  }

 private:
  struct Position {
    To to;
    std::uint64_t residue = 0;  // below 2^-32 ns, in units of 2^-85 ns
  };

  AffineMap(From from_base, To to_base, std::uint64_t residue, FixedRate rate) noexcept
      : from_base_(from_base), to_base_(to_base), residue_(residue), rate_(rate) {}

  // (whole + fraction 2^-32) * rate 2^-53: the whole part counts in 2^-53 ns, the fraction in 2^-85
  // ns.
  [[nodiscard]] Position evaluate(From instant) const noexcept {
    constexpr int kBits = FixedRate::kFractionBits;
    constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
    const Duration elapsed = instant - from_base_;
    const Int128 whole =
        static_cast<Int128>(elapsed.floor_ns()) * static_cast<Int128>(rate_.scaled());
    const UInt128 below_one =
        (static_cast<UInt128>(static_cast<std::uint64_t>(whole) & kMask) << 32) +
        static_cast<UInt128>(elapsed.fraction()) * rate_.scaled() + residue_;
    const auto advance = Duration::from_parts(static_cast<std::int64_t>(whole >> kBits), 0) +
                         Duration::from_parts(static_cast<std::int64_t>(below_one >> (kBits + 32)),
                                              static_cast<std::uint32_t>(below_one >> kBits));
    return {to_base_ + advance, static_cast<std::uint64_t>(below_one) & kMask};
  }

  From from_base_;
  To to_base_;
  std::uint64_t residue_ = 0;
  FixedRate rate_;
};

}  // namespace ftcs
