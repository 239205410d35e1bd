// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "apps/ftcs/ethercat/main_runner.h"
#include "ftcs/analysis/statistics.h"

namespace ftcs::app {

/// Of one figure of all traced cycles, us. Shows what lies inside the quantiles 0.1 and 99.9 %: one
/// stall would squeeze the rest into one bin; what is outside is counted.
[[nodiscard]] Histogram run_histogram(const RunFigures& figures, float RunPoint::*field);
/// One character a bin: "▁▂▅█▂▁".
[[nodiscard]] std::string histogram_bars(const Histogram& histogram);

}  // namespace ftcs::app
