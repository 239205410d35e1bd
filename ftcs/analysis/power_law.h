// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ftcs {

/// Power-law noise by its exponent alpha of S_y(f) = h_alpha f^alpha (NIST SP 1065, 3.2 and Table
/// 3).
enum class PowerLawNoise : std::int8_t {
  kRandomWalkFrequency = -2,
  kFlickerFrequency = -1,
  kWhiteFrequency = 0,
  kFlickerPhase = 1,
  kWhitePhase = 2,
};

/// "white PM" and so on, as the field writes them.
[[nodiscard]] const char* name(PowerLawNoise noise) noexcept;

/// Dominant noise of a phase record at averaging factor m by the lag 1 autocorrelation of the
/// record decimated by m (NIST SP 1065, 5.5; Riley & Greenhall, EFTF 2004): r1 of the n-th
/// difference gives delta = r1/(1 + r1), differencing goes on until delta < 1/4, and alpha = 2 - 2
/// (n + delta), rounded and kept within -2..2.
///
/// Each difference is taken about its mean, so that phase and frequency offset do not matter.
/// Missing points (not a number) leave out their pairs. Below kFewestPointsForNoise decimated
/// points the method is unreliable: the caller keeps the answer of a smaller m.
[[nodiscard]] PowerLawNoise identify_noise(std::span<const double> phase,
                                           std::size_t averaging_factor);

inline constexpr std::size_t kFewestPointsForNoise = 30;

/// What an estimator does to the phase, in the terms of Greenhall & Riley.
struct VarianceShape {
  int difference_order = 2;  ///< d: 2 Allan, 3 Hadamard
  bool modified = false;     ///< the phase is averaged over m points first (F = 1 instead of m)
  bool overlapping = true;   ///< stride 1 instead of m (S = m instead of 1)
};

/// Equivalent degrees of freedom of a variance estimate over `points` phase points at averaging
/// factor m.
///
/// C. A. Greenhall, W. J. Riley, "Uncertainty of Stability Variances Based on Finite Differences"
/// (PTTI 2003), the combined algorithm, eq. (7) to (13); NIST SP 1065, 5.4. The sum is evaluated
/// in full up to m = 1024; beyond, in its limit for large m, which depends on points/m alone
/// (flicker PM: and on ln m). Their phase is averaged over tau_0: against instantaneous readings
/// the figure is off by a share of about 1/m (white FM, m = 1: 17 % too many). Zero: not even one
/// term.
[[nodiscard]] double equivalent_degrees_of_freedom(PowerLawNoise noise, VarianceShape shape,
                                                   std::size_t averaging_factor,
                                                   std::size_t points);

/// The same for the total variance: b points/m - c (NIST SP 1065, 5.4, Table 7, p. 41, for alpha 0,
/// -1, -2; phase noise is given the white FM row, which is cautious).
[[nodiscard]] double total_degrees_of_freedom(PowerLawNoise noise, std::size_t averaging_factor,
                                              std::size_t points) noexcept;

/// Of the modified total variance: b points/m - c (NIST SP 1065, 5.4).
[[nodiscard]] double modified_total_degrees_of_freedom(PowerLawNoise noise,
                                                       std::size_t averaging_factor,
                                                       std::size_t points) noexcept;

/// Of the Hadamard total variance: (points/m) / (b0 + b1 m/points) (NIST SP 1065, 5.4, for
/// alpha 0, -1, -2; phase noise is given the white FM row, which is cautious).
[[nodiscard]] double hadamard_total_degrees_of_freedom(PowerLawNoise noise,
                                                       std::size_t averaging_factor,
                                                       std::size_t points) noexcept;

struct ConfidenceInterval {
  double lower;
  double upper;
};

/// Of a deviation, two-sided: sqrt(edf s^2 / chi^2_(1 -+ (1-p)/2)(edf)), NIST SP 1065 eq. (45). 0 <
/// confidence < 1. Without degrees of freedom: no figures.
[[nodiscard]] ConfidenceInterval confidence_interval(double deviation, double degrees_of_freedom,
                                                     double confidence);

}  // namespace ftcs
