// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "ftcs/daemon/ethercat/run_options.h"
#include "ftcs/daemon/phc/phc_options.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/platform/confinement.h"

namespace CLI {
class App;
}

namespace ftcs::app {

/// The rights of each command, and nothing beside them: the table in docs/security.md.
[[nodiscard]] platform::Confinement rights_of(const daemon::PtpOptions& options);
[[nodiscard]] platform::Confinement rights_of(const daemon::PhcOptions& options);
[[nodiscard]] platform::Confinement rights_of(const daemon::RunOptions& options);
[[nodiscard]] platform::Confinement rights_of_segment(bool raw, bool writes_file);

struct RightsArguments {
  std::string user;
  bool unconfined = false;
};

/// `may_change_user`: with --user.
void add_rights_flags(CLI::App& command, RightsArguments& arguments, bool may_change_user);

/// Confines this process as a command's rights have it. `once_open` becomes what the command calls
/// when it has opened all, to go on as --user. Returns what is wrong.
[[nodiscard]] std::optional<std::string> confine_to(
    platform::Confinement rights, const RightsArguments& arguments,
    std::function<std::optional<std::string>()>* once_open = nullptr);

}  // namespace ftcs::app
