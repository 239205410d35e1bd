// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/experiment/recorded_log.h"

namespace ftcs::experiment {

/// What one servo would have made of a recorded clock; figures over the second half.
struct ReplayResult {
  std::string servo;
  std::uint64_t samples = 0;
  double rms_offset_ns = 0.0;  ///< measured, before each update: the record's own noise is in it
  double max_offset_ns = 0.0;
  double rms_time_error_ns = 0.0;  ///< where the record tells the truth, else not a number
  double max_time_error_ns = 0.0;
  double rate_spread_ppb =
      0.0;  ///< deviation of the commanded tracking rates: how restless the servo is
  std::uint64_t commands = 0;
  std::uint64_t steps = 0;
  std::uint64_t rejected = 0;
  std::vector<double> time_s;
  std::vector<double> offset_ns;
};

/// Every servo, by name; the best first (by true error where it is known, else by measured offset).
/// A first step is allowed, as with ptp4l's defaults.
[[nodiscard]] std::vector<ReplayResult> replay_log(const RecordedLog& log);

}  // namespace ftcs::experiment
