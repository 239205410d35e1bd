// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "ftcs/experiment/paper_run.h"

namespace ftcs::experiment {

/// Every check of the table against the figures of its rows.
[[nodiscard]] std::vector<PaperCheckResult> judge_paper_table(const PaperResult& result);

}  // namespace ftcs::experiment
