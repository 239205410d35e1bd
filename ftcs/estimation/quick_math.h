// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>
#include <numbers>

#include "ftcs/estimation/lanes.h"

namespace ftcs::estimation {

/// Logarithm and exponential for evidence, where a nat more or less decides: no
/// table, no branch, the same bits on every machine, and as many at once as V
/// (double or Pair) has lanes.
namespace quick {

template <class V>
struct BitsOf {
  using Type = std::uint64_t;
};
template <>
struct BitsOf<Pair> {
  using Type = PairBits;
};
template <class V>
using Bits = typename BitsOf<V>::Type;

/// ln 2 in two parts: a multiple of the first by an integer of 11 bits is exact.
inline constexpr double kLn2High = 0.693147180369123816490;
inline constexpr double kLn2Low = 1.90821492927058770002e-10;
inline constexpr double kRound =
    6755399441055744.0;  ///< 1.5 2^52: what is added to it is rounded to an integer
inline constexpr std::uint64_t kMantissa = 0x000FFFFFFFFFFFFFULL;
inline constexpr std::uint64_t kSqrtHalf = 0x3FE6A09E667F3BCDULL;  ///< bits of sqrt(1/2)

}  // namespace quick

inline constexpr double kLn2Pi = 1.8378770664093453;  ///< of a normal density: ln(2 pi)
inline constexpr double kLeastExponent = -700.0;      ///< of quick_exp

/// Natural logarithm of a positive, finite, normal number; relative error of
/// the argument below 1e-9.
///
/// x = m 2^e with sqrt(1/2) <= m < sqrt(2); ln m = 2 artanh t, t = (m - 1) / (m
/// + 1), |t| < 0.172.
template <class V>
[[nodiscard]] inline V quick_log(const V& x) noexcept {
  using Bits = quick::Bits<V>;
  using quick::kMantissa, quick::kSqrtHalf;
  constexpr std::uint64_t kBias = 1023ULL << 52U;
  constexpr std::uint64_t kTwo52 = 0x4330000000000000ULL;  // bits of 2^52
  const Bits bits = std::bit_cast<Bits>(x) - kSqrtHalf;
  // An integer below 2^52 in the mantissa of 2^52 is that number once 2^52 is
  // taken off.
  const V biased = std::bit_cast<V>(((bits + kBias) >> 52U) | kTwo52);
  const V exponent = biased - (4503599627370496.0 + 1023.0);
  const V m = std::bit_cast<V>((bits & kMantissa) + kSqrtHalf);
  const V t = (m - 1.0) / (m + 1.0);
  const V u = t * t;
  const V series = 1.0 + u * (1.0 / 3 + u * (1.0 / 5 + u * (1.0 / 7 + u * (1.0 / 9))));
  return exponent * std::numbers::ln2 + 2.0 * t * series;
}

/// Exponential; relative error below 1e-8. Valid: |x| <= 700; beyond, any
/// number may come out.
///
/// x = n ln 2 + r, |r| <= ln 2 / 2: 2^n through the exponent bits, e^r by its
/// series.
template <class V>
[[nodiscard]] inline V quick_exp(const V& x) noexcept {
  using Bits = quick::Bits<V>;
  using quick::kLn2High, quick::kLn2Low, quick::kRound;
  const V shifted = x * (1.0 / std::numbers::ln2) + kRound;
  const V n = shifted - kRound;
  const V r = x - n * kLn2High - n * kLn2Low;
  const V high = 1.0 / 120 + r * (1.0 / 720 + r * (1.0 / 5040));
  const V series = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6 + r * (1.0 / 24 + r * high))));
  return std::bit_cast<V>(std::bit_cast<Bits>(series) + (std::bit_cast<Bits>(shifted) << 52U));
}

}  // namespace ftcs::estimation
