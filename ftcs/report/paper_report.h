// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/experiment/paper_run.h"
#include "ftcs/report/json.h"
#include "ftcs/report/table.h"

namespace ftcs {

/// Table 1 of the paper as text: the algorithm that runs.
[[nodiscard]] std::string algorithm_text();
/// The paper's figure, ours, the ratio, perceived and true, closed form; one row for each servo.
[[nodiscard]] Table paper_table(const experiment::PaperResult& result);
/// All of it for the console.
[[nodiscard]] std::string paper_console(const experiment::PaperResult& result);
/// {"tables": {"table2": [...], ...}, "checks": [...], "choices": [...], "figures": {...}}.
/// `complete`: nobody stopped the runs.
[[nodiscard]] Json paper_json(const std::vector<experiment::PaperResult>& results,
                              const std::string& version, bool complete);
[[nodiscard]] std::string paper_html(const std::vector<experiment::PaperResult>& results,
                                     const std::string& version);
/// One table for all rows of all tables.
[[nodiscard]] Table paper_csv(const std::vector<experiment::PaperResult>& results);

}  // namespace ftcs
