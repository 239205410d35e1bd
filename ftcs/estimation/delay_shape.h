// SPDX-License-Identifier: MIT
#pragma once

namespace ftcs::estimation {

/// Distribution of the delay noise of one direction, in units of the common
/// noise scale s: a normal part of variance `variance` plus, if `tail` > 0, an
/// exponential of mean `tail` (queueing is never negative). The zero of the
/// delay is the floor of the exponential part.
struct DelayShape {
  double variance = 1.0;  ///< > 0, units of s^2
  double tail = 0.0;      ///< >= 0, units of s

  /// Of the sum of both parts: that of an exponential is the square of its mean.
  [[nodiscard]] double total_variance() const noexcept { return variance + tail * tail; }
};

/// What one innovation says: with l(nu) the logarithm of its density,
/// slope = -l'(nu), curvature = -l''(nu), log_density = l(nu). For normal noise
/// of variance S: nu / S, 1 / S, -(nu^2 / S + ln 2 pi S) / 2. Masreliez's
/// filter (IEEE Trans. AC-20, 1975) uses slope and curvature in place of nu / S
/// and 1 / S: exact first two moments of the posterior when the prediction is
/// normal.
struct Score {
  double slope = 0.0;
  double curvature = 0.0;
  double log_density = 0.0;
};

/// Score of a normal prediction error of variance `spread` with normal noise
/// included.
[[nodiscard]] Score normal_score(double innovation, double spread) noexcept;

/// Score of the sum of a normal variable of variance `spread` and an
/// exponential one of mean `tail` (exponentially modified Gaussian). Innovation
/// positive = late. Valid: spread > 0, tail > 0. Where the exponential is too
/// short to be seen (spread >= 16 tail^2) it is taken as normal.
[[nodiscard]] Score late_score(double innovation, double spread, double tail) noexcept;

/// ln density of (normal of variance 1 - k^2) + (exponential of mean k) - k at
/// w: unit variance, zero mean; k in (0, 1) says how much of the variance is
/// queueing.
[[nodiscard]] double standard_late_log_density(double w, double k) noexcept;

}  // namespace ftcs::estimation
