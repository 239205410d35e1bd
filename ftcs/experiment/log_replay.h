// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/experiment/servo_library.h"
#include "ftcs/record/recorded_log.h"

namespace ftcs::experiment {

/// The row of the clock as it was recorded, steered by whoever steered it.
inline constexpr const char* kAsRecorded = "as recorded";

/// What one servo would have made of a recorded clock; figures over the second half.
struct ReplayResult {
  std::string servo;
  std::uint64_t samples = 0;
  double rms_offset_ns = 0.0;  ///< measured, before each update: the record's own noise is in it
  double max_offset_ns = 0.0;
  double rms_time_error_ns = 0.0;  ///< where the record tells the truth, else not a number
  double max_time_error_ns = 0.0;
  /// Median and 95 % of |true error|, or of |offset| where the truth is not known.
  double median_ns = 0.0;
  double percentile_95_ns = 0.0;
  /// Share of messages at which |estimated - true offset| was at most 1, 2, 3 of the deviations
  /// that the servo stated; not a number without a truth or without a stated deviation.
  std::array<double, 3> within_sigma{};
  double rate_spread_ppb =
      0.0;  ///< deviation of the commanded tracking rates: how restless the servo is
  std::uint64_t commands = 0;
  std::uint64_t steps = 0;
  std::uint64_t rejected = 0;
  /// Sample by sample, the whole record.
  std::vector<double> time_s;
  std::vector<double> offset_ns;
  std::vector<double> time_error_ns;  ///< in truth; not a number where the record does not tell
  std::vector<double> sigma_ns;       ///< stated deviation of the offset; not a number if none
};

/// Every servo of `servos` by name (empty: all) and, of a steered clock, the row "as recorded"; the
/// best first (by true error where it is known, else by measured offset). A first step is allowed,
/// as with ptp4l's defaults. Names must be of replay_servo_names().
[[nodiscard]] std::vector<ReplayResult> replay_log(
    const RecordedLog& log, const std::vector<std::string>& servos = {},
    const std::vector<std::shared_ptr<const ServoLibrary>>& libraries = {});

[[nodiscard]] std::vector<std::string> replay_servo_names();

}  // namespace ftcs::experiment
