// SPDX-License-Identifier: MIT
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/manual.h"

namespace ftcs::app {

// For packagers: it is not shown in --help.
void add_manual_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("manual", "print a manual page or a completion script");
  command->group("");
  const auto kind = std::make_shared<std::string>();
  const auto name = std::make_shared<std::string>();
  command->add_option("kind", *kind, "man, bash or zsh")
      ->required()
      ->check(CLI::IsMember({"man", "bash", "zsh"}));
  command->add_option("command", *name, "man: of this command; default: of the program");
  command->callback([&app, &exit_code, kind, name] {
    const std::string text = *kind == "man"    ? manual_page(app, *name)
                             : *kind == "bash" ? bash_completion(app)
                                               : zsh_completion(app);
    if (text.empty()) {
      fmt::print(stderr, "ftcs manual: there is no command '{}' (see ftcs --help)\n", *name);
      exit_code = kUsageError;
      return;
    }
    fmt::print("{}", text);
  });
}

}  // namespace ftcs::app
