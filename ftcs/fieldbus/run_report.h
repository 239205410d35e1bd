// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "ftcs/fieldbus/main_runner.h"
#include "ftcs/report/json_fwd.h"

namespace ftcs::daemon {

[[nodiscard]] const char* name(CycleState state);
[[nodiscard]] const char* name(node::BusMode mode);
[[nodiscard]] const char* name(node::CycleNote::Kind kind);
void print_scan(const ethercat::MainDevice& main);
/// One or two lines for the user: what failed, where, and what was expected.
[[nodiscard]] std::string describe(const ethercat::Failure& failure);
void print_run(const MainRunner& runner);
/// |0x092C| as it was last; null: nobody asked that drive.
[[nodiscard]] Json difference_json(const node::DriveClocks::Seen& clock);
[[nodiscard]] Json run_json(const MainRunner& runner);
/// The same as the text of a file.
[[nodiscard]] std::string run_json_text(const MainRunner& runner);

}  // namespace ftcs::daemon
