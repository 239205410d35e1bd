// SPDX-License-Identifier: MIT
#include "apps/ftcs/rights.h"

#include <CLI/CLI.hpp>

namespace ftcs::app {

void add_rights_flags(CLI::App& command, RightsArguments& arguments, bool may_change_user) {
  if (may_change_user) {
    command.add_option("--user", arguments.user, "go on as this user once all is open")
        ->type_name("NAME");
  }
  command.add_flag("--unconfined", arguments.unconfined,
                   "keep every right and system call: for debuggers and unusual systems");
}

std::optional<std::string> confine_to(platform::Confinement rights,
                                      const RightsArguments& arguments,
                                      std::function<std::optional<std::string>()>* once_open) {
  std::optional<platform::User> user;
  if (!arguments.user.empty()) {
    user = platform::find_user(arguments.user);
    if (!user) return "--user " + arguments.user + ": no such user";
    std::erase(rights.capabilities, CAP_DAC_OVERRIDE);
    rights.will_change_user = true;
  }
  if (user && once_open != nullptr) {
    *once_open = [user = *user, capabilities = rights.capabilities] {
      return platform::become_user(user, capabilities);
    };
  }
  if (arguments.unconfined) return std::nullopt;
  return platform::confine(rights);
}

}  // namespace ftcs::app
