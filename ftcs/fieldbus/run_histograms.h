// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "ftcs/analysis/statistics.h"
#include "ftcs/fieldbus/main_runner.h"

namespace ftcs::daemon {

/// Of one figure of all traced cycles, us. Shows what lies inside the quantiles 0.1 and 99.9 %: one
/// stall would squeeze the rest into one bin; what is outside is counted.
[[nodiscard]] Histogram run_histogram(const experiment::CycleFigures& figures,
                                      float experiment::CyclePoint::*field);
/// One character a bin: "▁▂▅█▂▁".
[[nodiscard]] std::string histogram_bars(const Histogram& histogram);

}  // namespace ftcs::daemon
