// SPDX-License-Identifier: MIT
#include "ftcs/analysis/mtie.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ftcs {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Extremes of a set of points; the empty set is its identity.
struct Extremes {
  double smallest = kInfinity;
  double largest = -kInfinity;
};

// A comparison with not-a-number is false, so that a gap leaves both as they were.
Extremes including(Extremes extremes, double x) noexcept {
  return {x < extremes.smallest ? x : extremes.smallest,
          x > extremes.largest ? x : extremes.largest};
}

struct Peak {
  double range = 0.0;
  std::size_t windows = 0;
};

/// Each window of `width` points is the end of one block of `width` and the beginning of the next:
/// the suffix extremes of the first, computed backwards, joined with the prefix extremes of the
/// second, computed on the way.
Peak largest_range(std::span<const double> x, std::size_t width) {
  Peak peak;
  std::vector<Extremes> suffix(width + 1);
  for (std::size_t block = 0; block + width <= x.size(); block += width) {
    suffix[width] = Extremes{};
    for (std::size_t i = width; i-- > 0;) suffix[i] = including(suffix[i + 1], x[block + i]);
    Extremes prefix;
    const std::size_t windows = std::min(width, x.size() - block - width + 1);
    for (std::size_t start = 0; start < windows; ++start) {
      if (start > 0) prefix = including(prefix, x[block + width + start - 1]);
      const Extremes& rest = suffix[start];
      const double range =
          std::max(rest.largest, prefix.largest) - std::min(rest.smallest, prefix.smallest);
      // Without a point it is minus infinity.
      if (range >= 0.0) ++peak.windows;
      peak.range = std::max(peak.range, range);
    }
  }
  return peak;
}

}  // namespace

std::vector<MtiePoint> mtie(PhaseRecord record, std::span<const std::size_t> averaging_factors,
                            double confidence) {
  std::vector<MtiePoint> points;
  for (const std::size_t n : averaging_factors) {
    if (n == 0 || n + 1 > record.seconds.size()) continue;
    const Peak peak = largest_range(record.seconds, n + 1);
    if (peak.windows == 0) continue;
    // Gaps count as record that is not there: windows + n points hold so many side by side.
    const std::size_t independent = (peak.windows + n) / (n + 1);
    points.push_back({n, static_cast<double>(n) * record.interval_s, peak.range, peak.windows,
                      std::pow(1.0 - confidence, 1.0 / static_cast<double>(independent))});
  }
  return points;
}

}  // namespace ftcs
