// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ftcs/time/result.h"

namespace ftcs {

/// Values on equal intervals.
struct GriddedValues {
  std::vector<double> values;  ///< missing = not a number
  double interval_s = 1.0;
  std::size_t crowded = 0;  ///< values that came less than half an interval after the one before
};

struct GridError {
  std::string message;
};

/// Puts values with ascending times on a grid of `interval_s`, or of their own if none is
/// given: a straight line through the times, of whose slope the shortest number within three
/// standard deviations is taken (stamps rounded to milliseconds do not change 62.5 ms).
///
/// Step by step: the next place is the nearest one to the time that has passed, at least one; the
/// grid follows the times with a gain of kGridGain, so that jitter of a log moves nothing and a
/// wrong last digit of the interval does not add up. As many times as values.
[[nodiscard]] Result<GriddedValues, GridError> place_on_grid(std::span<const double> values,
                                                             std::span<const double> times_s,
                                                             std::optional<double> interval_s);

}  // namespace ftcs
