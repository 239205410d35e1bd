// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "ftcs/fieldbus/main_runner.h"
#include "ftcs/fieldbus/segment_server.h"
#include "ftcs/report/html_report.h"
#include "ftcs/report/table.h"

namespace ftcs::daemon {

/// One row for each run: lock, phase, frame, working counter.
[[nodiscard]] Table runs_table(std::span<const MainRunner* const> runs);
/// Phase over time, histograms of margin, lateness and phase of the first run, one table.
void add_run_sections(HtmlReport& report, std::span<const MainRunner* const> runs);
/// What the drives saw, as the segment knows it.
[[nodiscard]] Table drives_table(const SegmentServer& server);

}  // namespace ftcs::daemon
