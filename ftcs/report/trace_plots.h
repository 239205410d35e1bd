// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "ftcs/experiment/scenario_run.h"
#include "ftcs/report/plot.h"

namespace ftcs {

/// One run of every servo, drawn: how it locks (|time error|, logarithmic), time error and rate
/// error over the measurement window, the distribution of |time error|, TDEV and MTIE of the
/// window.
[[nodiscard]] std::vector<Plot> trace_plots(const std::vector<experiment::RunTrace>& traces);

}  // namespace ftcs
