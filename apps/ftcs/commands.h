// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/daemon/exit_code.h"

namespace CLI {
class App;
}

namespace ftcs::app {

using enum daemon::ExitCode;

/// Each adds one subcommand; when it is the one that was given, it runs and leaves its code in
/// `exit_code`.
void add_analyse_command(CLI::App& app, int& exit_code);
void add_compare_command(CLI::App& app, int& exit_code);
void add_demo_command(CLI::App& app, int& exit_code);
void add_doctor_command(CLI::App& app, int& exit_code);
void add_ethercat_command(CLI::App& app, int& exit_code);
void add_ethercat_segment_command(CLI::App& app, int& exit_code);
void add_manual_command(CLI::App& app, int& exit_code);
void add_paper_command(CLI::App& app, int& exit_code);
void add_phc_command(CLI::App& app, int& exit_code);
void add_ptp_command(CLI::App& app, int& exit_code);
void add_simulate_command(CLI::App& app, int& exit_code);
void add_status_command(CLI::App& app, int& exit_code);

}  // namespace ftcs::app
