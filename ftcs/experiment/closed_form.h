// SPDX-License-Identifier: MIT
#pragma once

namespace ftcs::experiment {

// What white timestamp noise of standard deviation sigma makes of a servo in steady state, linear
// model.

/// Variance of a figure in units of sigma^2.
struct NoiseGain {
  double time_error = 0.0;  ///< true offset at the sample instants
  double perceived = 0.0;   ///< time_error + 1: the sample's own noise is independent of it
};

/// FTCS with weight p in (0, 1]: true (2 + 3p)/(2 - p), from theta(n+1) = (1 - p) theta(n) - (1 +
/// p) N(n) + N(n-1). For p = 0 the offset about its own (frozen) mean: true 1, perceived 2.
[[nodiscard]] NoiseGain ftcs_noise_gain(double offset_gain) noexcept;

/// Incremental PI with normalised gains (paper eq. 26), sampled once an interval:
///   theta(n+1) = (2 - Kp - Ki) theta(n) - (1 - Kp) theta(n-1) - (Kp + Ki) N(n) + Kp N(n-1)
/// Infinite if the loop is not stable.
[[nodiscard]] NoiseGain pics_noise_gain(double proportional_gain, double integral_gain) noexcept;

}  // namespace ftcs::experiment
