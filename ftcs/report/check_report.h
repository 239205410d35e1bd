// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/experiment/paper_run.h"
#include "ftcs/report/json.h"
#include "ftcs/report/table.h"

namespace ftcs {

/// Every check of a table of the paper: what was demanded and what came.
[[nodiscard]] Table checks_table(const std::vector<experiment::PaperCheckResult>& checks);
/// What the paper leaves open, what was chosen, and why.
[[nodiscard]] Table choices_table(const std::vector<experiment::PaperChoice>& choices);
/// The same as objects, each with the name of its table ("table2"), appended to `array`.
void append_checks(Json& array, const std::string& table,
                   const std::vector<experiment::PaperCheckResult>& checks);
void append_choices(Json& array, const std::string& table,
                    const std::vector<experiment::PaperChoice>& choices);
/// A row's own verdict: every demand that speaks of it alone.
[[nodiscard]] bool row_passed(const std::vector<experiment::PaperCheckResult>& checks,
                              const std::string& row);

}  // namespace ftcs
