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
};

/// Maximum time interval error: the largest peak-to-peak time error in any window of length tau = n
/// tau_0.
///
///   MTIE(n tau_0) = max_k (max_(k<=i<=k+n) x_i - min_(k<=i<=k+n) x_i)      ITU-T G.810 (1996),
///   II.5
///
/// A missing point is left out of its windows. A maximum has no confidence interval of the
/// chi-squared kind: MTIE of a record bounds what happened in that record, and grows with its
/// length; `windows` says how much was seen.
///
/// O(N) for each factor whatever its size (van Herk 1992, Gil & Werman 1993: block prefixes and
/// suffixes), with O(n) memory. Factors that need more points than there are are left out.
[[nodiscard]] std::vector<MtiePoint> mtie(PhaseRecord record,
                                          std::span<const std::size_t> averaging_factors);

}  // namespace ftcs
