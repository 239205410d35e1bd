// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace ftcs::estimation {

/// Exponential and logarithm to the last bits and the tail of the normal distribution, of IEEE
/// 754's own operations alone: a C library rounds its own way on each machine, and a servo built on
/// it would decide by it. Where a nat more or less decides, quick_math.h is quicker.

/// e^x, less than 1 unit in the last place off; zero below -746, infinite above 710, NaN of NaN.
///
/// x = n ln 2 + r, |r| <= ln 2 / 2, the series of e^r to r^13.
[[nodiscard]] double portable_exp(double x) noexcept;

/// ln x, less than 1 unit in the last place off; x normal and finite; minus infinite at zero.
///
/// x = m 2^e with sqrt(1/2) <= m < sqrt(2); ln m = 2 artanh t, t = (m - 1) / (m + 1).
[[nodiscard]] double portable_log(double x) noexcept;

/// e^(x^2) erfc(x), less than 7 units in the last place off; x >= 0 and finite. The normal
/// distribution's tail without its density: 1 - Phi(u) = phi(u) sqrt(pi / 2) scaled_erfc(u /
/// sqrt(2)).
///
/// (1 + 2 x) e^(x^2) erfc(x) is smooth in (x - 15/4) / (x + 15/4), from 0 to infinity (Shepherd and
/// Laframboise, Mathematics of Computation 36, 1981): its Chebyshev series to degree 22.
[[nodiscard]] double scaled_erfc(double x) noexcept;

/// The fraction of n / phi less a half, phi the golden ratio: spread more evenly over -1/2 to 1/2
/// than chance would, from any n on (Weyl, Mathematische Annalen 77, 1916).
[[nodiscard]] constexpr double even_spread(std::uint32_t n) noexcept {
  return 0x1p-32 * static_cast<double>(n * 2'654'435'769U) - 0.5;
}

}  // namespace ftcs::estimation
