// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "ftcs/analysis/stability.h"
#include "ftcs/daemon/watch/watch_state.h"

namespace ftcs::daemon {

/// Counts of offsets in bins of one width.
struct WatchHistogram {
  double lowest_ns = 0.0;
  double width_ns = 0.0;
  std::vector<std::uint32_t> counts{};
};

/// What the points of the past come to: bounded memory, whatever comes.
class WatchHistory {
 public:
  void add(const WatchPoint& point);

  /// ADEV and TDEV of the offsets, taken as equally spaced; they reach further as time goes.
  [[nodiscard]] std::vector<StabilityPoint> deviations(Deviation deviation) const;
  [[nodiscard]] WatchHistogram histogram() const;
  /// Largest magnitude of the last used ones; none: there are none.
  [[nodiscard]] std::optional<double> largest_ns() const;
  /// The points to begin a picture with, oldest first.
  [[nodiscard]] const std::vector<WatchPoint>& recent() const { return recent_; }

 private:
  void thin_out();

  // Offsets of used points; twice as far apart each time that there are too many, so that the whole
  // run stays in view.
  std::vector<double> offsets_s_;
  std::size_t every_ = 1;
  std::size_t skipped_ = 0;
  double first_s_ = 0.0;
  double last_s_ = 0.0;
  std::vector<WatchPoint> recent_;
};

}  // namespace ftcs::daemon
