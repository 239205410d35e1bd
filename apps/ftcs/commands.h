// SPDX-License-Identifier: MIT
#pragma once

namespace CLI {
class App;
}

namespace ftcs::app {

/// Exit codes of every subcommand (docs/ptp.md); stable.
enum ExitCode : int {
  kSuccess = 0,       ///< done; a time receiver: locked when it stopped
  kRuntimeError = 1,  ///< the system refused something, or the reference is not usable
  kUsageError = 2,    ///< a wrong flag, value or configuration file
  kNotLocked = 3,     ///< stopped in good order, but not locked
};

/// Each adds one subcommand; when it is the one that was given, it runs and leaves its code in
/// `exit_code`.
void add_analyse_command(CLI::App& app, int& exit_code);
void add_compare_command(CLI::App& app, int& exit_code);
void add_demo_command(CLI::App& app, int& exit_code);
void add_ethercat_command(CLI::App& app, int& exit_code);
void add_ethercat_segment_command(CLI::App& app, int& exit_code);
void add_manual_command(CLI::App& app, int& exit_code);
void add_paper_command(CLI::App& app, int& exit_code);
void add_phc_command(CLI::App& app, int& exit_code);
void add_ptp_command(CLI::App& app, int& exit_code);
void add_simulate_command(CLI::App& app, int& exit_code);
void add_status_command(CLI::App& app, int& exit_code);

}  // namespace ftcs::app
