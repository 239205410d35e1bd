// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "ftcs/daemon/sample_report.h"
#include "ftcs/daemon/watch/watch_state.h"
#include "ftcs/diagnosis/finding.h"
#include "ftcs/discipline/clock_discipline.h"

namespace ftcs::daemon {

/// What a clock that follows is doing, for those who watch it; kind, target, reference and uptime
/// are the caller's to fill in.
[[nodiscard]] WatchState watch_state(const ClockDiscipline& discipline, std::string_view servo,
                                     const diagnosis::Finding& finding);
[[nodiscard]] WatchPoint watch_point(const SampleRecord& record);

}  // namespace ftcs::daemon
