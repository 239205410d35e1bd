// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "ftcs/diagnosis/cycle_diagnosis.h"
#include "ftcs/fieldbus/run_options.h"
#include "ftcs/platform/kernel.h"

namespace ftcs::daemon {

/// `ftcs ethercat scan`: what is on the wire, to the standard output. Returns an exit code; what
/// went wrong stands on standard error.
[[nodiscard]] int scan_ethercat(platform::Kernel& kernel, const RunOptions& options);
/// `ftcs ethercat run`: plant time, drives, cycles, figures and files. Can the files of the options
/// be written, is asked before.
[[nodiscard]] int run_ethercat(platform::Kernel& kernel, const RunOptions& options);

/// Of a run that ended so: zero only where its sentence (diagnosis::write_sentence) begins with
/// "locked".
[[nodiscard]] int exit_code_of(const diagnosis::CycleSeen& seen) noexcept;

/// Shifts of SYNC0 and SYNC1 are within a cycle, which is known when all options are; one sentence
/// if one is not.
[[nodiscard]] std::optional<std::string> check_drive_sync(const RunOptions& options);
/// The same, and whether supervision and bus clock can work with these options.
[[nodiscard]] std::optional<std::string> check_run(const RunOptions& options);

}  // namespace ftcs::daemon
