// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/experiment/log_replay.h"
#include "ftcs/record/recorded_log.h"
#include "ftcs/report/json.h"
#include "ftcs/report/table.h"

namespace ftcs {

/// A recorded log and what each servo would have made of it.
struct LogComparison {
  std::string file;
  RecordedLog log;
  std::vector<experiment::ReplayResult> servos;  ///< best first
};

[[nodiscard]] Table log_table(const LogComparison& comparison);
[[nodiscard]] std::string log_console(const LogComparison& comparison);
/// {"log": {...}, "servos": [...]}.
[[nodiscard]] Json log_json(const LogComparison& comparison, const std::string& version);
/// Every sample of every servo: servo, time_s, offset_ns, time_error_ns, sigma_ns; what is not
/// known is empty.
[[nodiscard]] std::string log_trace_csv(const LogComparison& comparison);
[[nodiscard]] std::string log_html(const LogComparison& comparison, const std::string& version);

}  // namespace ftcs
