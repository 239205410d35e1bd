// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "ftcs/experiment/cycle_experiment.h"
#include "ftcs/report/json_fwd.h"
#include "ftcs/report/plot.h"
#include "ftcs/report/table.h"

namespace ftcs {

/// Table 6 of the paper beside ours: perceived, event and virtual error of each row.
[[nodiscard]] Table cycle_table(const experiment::CycleResult& result);
/// The circle of two axes: contour error and missed SYNC0 windows of each way to keep the cycle.
[[nodiscard]] Table contour_table(const std::vector<experiment::ContourRow>& rows);
/// Two machines, one time: SYNC0 against SYNC0 and the circle whose axes stand apart.
[[nodiscard]] Table two_machines_table(const experiment::TwoMachinesResult& result);
[[nodiscard]] std::string two_machines_method(const experiment::TwoMachinesResult& result);
[[nodiscard]] Json two_machines_json(const experiment::TwoMachinesResult& result);
/// How far the drawn circle is off, over one turn, of each mode.
[[nodiscard]] Plot two_machines_plot(const experiment::TwoMachinesResult& result);
[[nodiscard]] std::string cycle_console(const experiment::CycleResult& result);
/// {"version", "passed", "tables": {"table6": [...], "two_machines": [...]}, "checks", "choices",
/// "figures": {"figure7"}, "contour": {"world", "rows": [...], "live": [...]}}.
[[nodiscard]] Json cycle_json(const experiment::CycleResult& result, const std::string& version);
[[nodiscard]] std::string cycle_html(const experiment::CycleResult& result,
                                     const std::string& version);

}  // namespace ftcs
