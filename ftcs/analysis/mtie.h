// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "ftcs/analysis/stability.h"

namespace ftcs {

struct MtiePoint {
  std::size_t averaging_factor = 0;  ///< n: the window holds n + 1 points
  double tau_s = 0.0;
  double mtie_s = 0.0;
  std::size_t windows = 0;  ///< windows with a point present
  /// With the confidence asked for, at least this share of all windows of this length that the
  /// clock could show stays below mtie_s (see mtie()).
  double covered_share = 0.0;
};

/// Maximum time interval error: the largest peak-to-peak time error in any window of length tau = n
/// tau_0.
///
///   MTIE(n tau_0) = max_k (max_(k<=i<=k+n) x_i - min_(k<=i<=k+n) x_i)      ITU-T G.810 (1996),
///   II.5
///
/// A missing point is left out of its windows. A maximum has no confidence interval of the
/// chi-squared kind: it grows with the length of the record. What can be said without assuming a
/// distribution is how much of it was seen: of K independent windows (those that do not overlap, K
/// = N / n) the largest exceeds the p-quantile with probability 1 - p^K, so with confidence c at
/// least
///
///   p = (1 - c)^(1/K)      (Wilks, Ann. Math. Stat. 12, 1941)
///
/// of all windows stay below it, as long as the process does not change. G.810 defines MTIE as such
/// a quantile.
///
/// O(N) for each factor whatever its size (van Herk 1992, Gil & Werman 1993: block prefixes and
/// suffixes), with O(n) memory. Factors that need more points than there are are left out.
[[nodiscard]] std::vector<MtiePoint> mtie(PhaseRecord record,
                                          std::span<const std::size_t> averaging_factors,
                                          double confidence = kOneSigmaConfidence);

}  // namespace ftcs
