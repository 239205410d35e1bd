// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "ftcs/record/recorded_log.h"

namespace ftcs {

/// Values and times as they stand in a file.
struct RawSeries {
  std::vector<double> values;  ///< s, or fractions; missing = not a number
  std::vector<double> times;   ///< s, ascending; empty = the file has none
};

/// What the recorded clock showed minus the reference, its steering included, at each forward
/// message from its lock on (from the first one, if the log knows no lock). Lines without a time
/// make a series without times.
///
/// Exchanges give ((t2 - t1) - (t4 - t3)) / 2 (IEEE 1588-2019, 11.3): each Sync with the answered
/// Delay_Req that is nearest in time. A Sync with none within an interval has no value.
[[nodiscard]] RawSeries offsets_of(const RecordedLog& log);

}  // namespace ftcs
