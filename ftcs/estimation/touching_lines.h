// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/floor_record.h"
#include "ftcs/estimation/lanes.h"

namespace ftcs::estimation {

/// Messages of one window of the record, oldest first, side by side where a fit reads them often.
struct FloorMessages {
  static constexpr std::size_t kCapacity = LongestRecord::kCapacity;
  static_assert(kCapacity % 2 == 0);
  std::array<double, kCapacity> lifted{};        ///< sign (z - base), ns
  std::array<std::int32_t, kCapacity> before{};  ///< 1 / RecordWindow::kUnitsPerCycle cycles
  std::size_t size = 0;
  double sign = 1.0;  ///< of the direction

  /// Heights relative to `base`, ns; the window is one of the longest record, or shorter.
  void read(Direction direction, const RecordWindow& window, double base) noexcept;
  /// Cycles before the last message, negative.
  [[nodiscard]] double time(std::size_t k) const noexcept {
    return static_cast<double>(before[k]) / RecordWindow::kUnitsPerCycle;
  }
  /// Above sign x + sign y t + d = 0, at the rate y in ns per cycle.
  [[nodiscard]] double height(std::size_t k, double rate) const noexcept {
    return lifted[k] - sign * rate * time(k);
  }
  /// Of the messages k and k + 1; k even. One beyond the last has any height.
  [[nodiscard]] Pair heights(std::size_t k, double rate) const noexcept {
    const Pair times{time(k), time(k + 1)};
    return load<Pair>(&lifted[k]) - sign * rate * times;
  }
};

/// Lines of one rate that touch both directions' messages from below.
struct TouchingLines {
  double rate = 0.0;   ///< ns per cycle
  double width = 0.0;  ///< ns above the lines, of messages at the floor; 0: there are none
  PerDirection<double> floor{};  ///< ns, the heights that they touch at
  double mean = 0.0;             ///< ns, of all messages above them
};

/// Those that separate messages at the floor from those that wait best. Candidates for the rate are
/// the edges of the lower convex hulls of both directions (Andrew, Inf. Proc. Letters 9, 1979; for
/// clocks: Moon, Skelly and Towsley, INFOCOM 1999). For each, the messages' heights above both
/// lines, by octaves above `smallest` ns: the best likelihood of a share that lies evenly within a
/// width, and waits beyond it. At most 48 candidates. Each direction has a message at least; times
/// never fall. `width` is 0 where no two messages of a direction are half a cycle apart, or fewer
/// than six lie together.
[[nodiscard]] TouchingLines best_touching_lines(const PerDirection<FloorMessages>& messages,
                                                double smallest) noexcept;

}  // namespace ftcs::estimation
