// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/floor_record.h"

namespace ftcs::estimation {

/// Messages of one window of the record, oldest first, side by side where a fit reads them often.
struct FloorMessages {
  static constexpr std::size_t kCapacity = LongestRecord::kCapacity;
  std::array<double, kCapacity> lifted;        ///< sign (z - base), ns
  std::array<std::int32_t, kCapacity> before;  ///< 1 / RecordWindow::kUnitsPerCycle cycles
  std::size_t size = 0;
  double sign = 1.0;  ///< of the direction

  void read(Direction direction, const RecordWindow& window, double base) noexcept;
  /// Cycles before the last message, negative.
  [[nodiscard]] double time(std::size_t k) const noexcept {
    return static_cast<double>(before[k]) / RecordWindow::kUnitsPerCycle;
  }
  /// Above sign x + sign y t + d = 0, at the rate y in ns per cycle.
  [[nodiscard]] double height(std::size_t k, double rate) const noexcept {
    return lifted[k] - sign * rate * time(k);
  }
};

/// The rate at which lines that touch both directions' messages from below separate messages at the
/// floor from those that wait best, and the width of that floor.
struct TouchingRate {
  double rate = 0.0;   ///< ns per cycle
  double width = 0.0;  ///< ns; 0: there is none
};

/// Lines of one rate that touch both directions from below.
struct TouchingLines {
  PerDirection<double> floor{};  ///< ns, the heights that they touch at
  double mean = 0.0;             ///< ns, of all messages above them
  double highest = 0.0;          ///< the same, of the direction in which it is larger
};

/// Candidates are the edges of the lower convex hulls of both directions (Andrew, Inf. Proc.
/// Letters 9, 1979; for clocks: Moon, Skelly and Towsley, INFOCOM 1999). For each, the messages'
/// heights above both touching lines, by octaves above `smallest` ns: the best likelihood of a
/// share that lies evenly within a width, and waits beyond it. At most 48 candidates; a window has
/// one message of each direction at least.
[[nodiscard]] TouchingRate best_touching_rate(const PerDirection<FloorMessages>& messages,
                                              double smallest) noexcept;
[[nodiscard]] TouchingLines touching_lines(const PerDirection<FloorMessages>& messages,
                                           double rate) noexcept;

}  // namespace ftcs::estimation
