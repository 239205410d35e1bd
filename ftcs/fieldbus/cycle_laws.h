// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "ftcs/fieldbus/main_runner.h"

namespace ftcs::daemon {

/// What --servo knows.
[[nodiscard]] std::span<const std::string> cycle_law_names();
/// Sets law, interval and gains of one of them. SOEM's published sample, T + 0.01 e + 2e-5 sum(e)
/// every cycle, is in increments PICS with an interval of one cycle; it takes the frame's time for
/// the cycle's, as its authors do.
void set_cycle_law(RunOptions& options, std::string_view name);

}  // namespace ftcs::daemon
