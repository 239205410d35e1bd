// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "ftcs/analysis/power_law.h"

namespace ftcs {

/// A phase record x_1 .. x_N: time errors (local minus reference) in seconds at equal intervals.
///
/// A missing point is not a number. Its place must be kept, so that the others stay on the grid.
struct PhaseRecord {
  std::span<const double> seconds;
  double interval_s = 1.0;  ///< tau_0 > 0
};

/// The estimators, tau = m tau_0, D_i = x_(i+2m) - 2 x_(i+m) + x_i. Equations and pages: NIST SP
/// 1065 (2008).
enum class Deviation : std::uint8_t {
  /// ADEV: sqrt(mean D_i^2 / (2 tau^2)) over i = 1, 1+m, 1+2m, ... Eq. (7), p. 15.
  kAllan,
  /// OADEV: the same over every i. Eq. (11), p. 16.
  kOverlappingAllan,
  /// MDEV: the mean of m successive D_i in place of D_i. Eq. (14), p. 17.
  kModifiedAllan,
  /// TDEV = tau MDEV / sqrt(3), in seconds. Eq. (15), p. 18; ITU-T G.810, II.3.
  kTime,
  /// HDEV: sqrt(mean (x_(i+3m) - 3 x_(i+2m) + 3 x_(i+m) - x_i)^2 / (6 tau^2)), i = 1, 1+m, ... Eq.
  /// (18), p. 20.
  kHadamard,
  /// OHDEV: the same over every i. Eq. (20), p. 21.
  kOverlappingHadamard,
  /// TOTDEV: OADEV of the record extended at both ends by its point reflection, N - 2 terms at
  /// every tau.
  /// Eq. (25), p. 23. Not corrected for its bias at long tau (flicker FM: -0.24 tau/T of the
  /// variance).
  kTotal,
  /// MTOT: MDEV of every stretch of 3m points, its half-average slope taken off and continued at
  /// both
  /// ends by its mirror image. SP 1065, 5.2. Up to m = N/3. Corrected for the bias that the noise
  /// found at that tau gives it: the variance is 0.94 (white PM), 0.83 (flicker PM), 0.73 (white
  /// FM),
  /// 0.70 (flicker FM) or 0.69 (random walk FM) of MVAR (Howe & Vernotte 1999).
  kModifiedTotal,
  /// TTOT = tau MTOT / sqrt(3), in seconds.
  kTimeTotal,
  /// HTOT: the same as MTOT of stretches of 3m frequencies, with the factor of the Hadamard
  /// deviation; at m = 1 OHDEV. Corrected likewise: 0.995 (white FM), 0.851 (flicker FM), 0.771
  /// (random walk FM) of the Hadamard variance.
  kHadamardTotal,
};

/// The estimator of a name in small letters, "oadev"; nothing if there is none.
[[nodiscard]] std::optional<Deviation> deviation_named(std::string_view name) noexcept;
/// All of them, in the order above.
[[nodiscard]] std::span<const Deviation> all_deviations() noexcept;

/// "ADEV", "OADEV", ...
[[nodiscard]] const char* name(Deviation deviation) noexcept;

struct StabilityPoint {
  std::size_t averaging_factor = 0;
  double tau_s = 0.0;
  double deviation = 0.0;
  double lower = 0.0;  ///< of the confidence interval; not a number without degrees of freedom
  double upper = 0.0;
  std::size_t terms = 0;  ///< squares that were averaged
  double degrees_of_freedom = 0.0;
  PowerLawNoise noise =
      PowerLawNoise::kWhitePhase;  ///< identified at this tau, decides the interval
};

/// One sigma of a normal distribution, two-sided: the custom of the field (SP 1065, 5.3).
inline constexpr double kOneSigmaConfidence = 0.6826894921370859;

/// The deviation at every averaging factor for which the record has at least one term; others are
/// left out.
///
/// Gaps: a term counts only if each phase point in it is present (leading and trailing gaps are cut
/// off first). MDEV and TDEV average the D_i that are present in a window of m, if at least three
/// quarters of them are: since D_i holds neither phase nor frequency offset, an uneven choice does
/// not bias it, and white PM raises the result by at most 1/sqrt(0.75) - 1 = 15 %. The degrees of
/// freedom are scaled by the share of terms that counted.
///
/// O(N) for each factor (a tenth of a second for 10^7 points); MTOT, TTOT and HTOT O(N m) up to
/// kMostExactTotal, beyond it every (m/16)-th stretch is taken, which are nearly all of the degrees
/// of freedom: O(N) too.
///
/// The noise that decides an interval is identified at each tau as long as the record has
/// kFewestPointsForNoise points of it. Beyond, the last answer is kept, and the fewest degrees of
/// freedom of it and of noise redder by up to one power of f an octave are taken.
[[nodiscard]] std::vector<StabilityPoint> stability(Deviation deviation, PhaseRecord record,
                                                    std::span<const std::size_t> averaging_factors,
                                                    double confidence = kOneSigmaConfidence);

/// N m up to which the total deviations of stretches take every stretch.
inline constexpr double kMostExactTotal = 4e6;

/// 1, 2, 4, 8, ... as long as `points` phase points give a term of the Allan deviation.
[[nodiscard]] std::vector<std::size_t> octave_factors(std::size_t points);
/// 1, 2, 4, 10, 20, 40, 100, ... likewise.
[[nodiscard]] std::vector<std::size_t> decade_factors(std::size_t points);

/// Every factor from 1 to as many points as give a term; above 1,000 points at most 1,000 of them,
/// equally spaced on a logarithmic scale.
[[nodiscard]] std::vector<std::size_t> all_factors(std::size_t points);

/// x_1 = 0, x_(i+1) = x_i + y_i tau_0 (SP 1065, 3.1): one point more than `frequency`. The mean is
/// kept. A missing y leaves every later phase unknown: it is replaced by the mean of the others,
/// and the phase points on both sides of it are kept; those inside a run of missing ones become not
/// a number.
[[nodiscard]] std::vector<double> phase_from_frequency(std::span<const double> frequency,
                                                       double interval_s);

}  // namespace ftcs
