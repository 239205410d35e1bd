// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "ftcs/platform/confinement.h"

namespace CLI {
class App;
}

namespace ftcs::app {

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
