// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/experiment/scenario_run.h"
#include "ftcs/report/plot.h"

namespace ftcs {

/// One run of every servo, drawn: how it locks (|time error|, logarithmic), time error and rate
/// error over the measurement window, the distribution of |time error|, TDEV and MTIE of the
/// window.
[[nodiscard]] std::vector<Plot> trace_plots(const std::vector<experiment::RunTrace>& traces);

/// The same runs for other programs: servo,time_s,time_error_ns,rate_error_ppb, a row for each
/// sample, one servo after the other.
[[nodiscard]] std::string trace_csv(const std::vector<experiment::RunTrace>& traces);

}  // namespace ftcs
