// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace ftcs::app {

// Made of the same option tables as --help, so that they cannot say anything else.

/// The manual page (section 1, man(7)) of the program, or with `command` of that subcommand and of
/// those below it. Empty: there is no such command.
[[nodiscard]] std::string manual_page(const CLI::App& program, const std::string& command);
/// A completion script for bash: commands, options, the values of options that have a list.
[[nodiscard]] std::string bash_completion(const CLI::App& program);
/// The same for zsh, as the function _ftcs.
[[nodiscard]] std::string zsh_completion(const CLI::App& program);

}  // namespace ftcs::app
