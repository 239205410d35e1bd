// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "ftcs/report/suggestion.h"

namespace {

/// The peers' programs, by whose names ours may be looked for.
std::string command_for(const std::string& name, const std::vector<std::string>& commands) {
  if (name == "ptp4l") return "ptp";
  if (name == "phc2sys") return "phc";
  if (name == "pmc") return "status";
  return ftcs::suggestion(name, commands);
}

/// What is wrong with the command line. An option that nobody knows comes first: its value may have
/// been taken for an argument, and what CLI11 then says is of that argument.
std::string complaint(const CLI::App& app, const CLI::Error& error) {
  std::vector<std::string> left = app.remaining(true);
  std::erase(left, "--");
  const auto is_option = [](const std::string& word) { return word.starts_with('-'); };
  const auto option = std::find_if(left.begin(), left.end(), is_option);
  if (option == left.end()) {
    const bool is_extra = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
    return is_extra ? fmt::format("unexpected argument '{}'", left.front()) : error.what();
  }
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* known : command->get_options()) {
      for (const std::string& name : known->get_lnames()) names.push_back("--" + name);
    }
  }
  const std::string name = option->substr(0, option->find('='));
  return fmt::format("unknown option '{}'{}", name,
                     ftcs::did_you_mean(ftcs::suggestion(name, names)));
}

int run(std::vector<std::string> words) {
  using namespace ftcs::app;
  // As others have it: "help ptp" is "ptp --help".
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  const std::string name = words.empty() ? std::string() : words.front();
  CLI::App app{"Clocks that follow other clocks: frequency-tracking clock servos over PTP", "ftcs"};
  app.set_version_flag("-v,--version", "ftcs " FTCS_VERSION);
  app.require_subcommand(1);
  int exit_code = kSuccess;
  for (const auto add :
       {add_analyse_command, add_demo_command, add_compare_command, add_doctor_command,
        add_ethercat_command, add_ethercat_segment_command, add_manual_command, add_paper_command,
        add_phc_command, add_ptp_command, add_simulate_command, add_status_command}) {
    add(app, exit_code);
  }
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
  const bool has_command = std::find(commands.begin(), commands.end(), name) != commands.end();
  if (!words.empty() && !name.starts_with('-') && !has_command) {
    fmt::print(stderr, "ftcs: unknown command '{}'{} (see ftcs --help)\n", name,
               ftcs::did_you_mean(command_for(name, commands)));
    return kUsageError;
  }
  try {
    std::reverse(words.begin(), words.end());  // CLI11 takes them from the end
    app.parse(words);
  } catch (const CLI::Success& request) {  // --help, --version
    return app.exit(request);
  } catch (const CLI::Error& error) {
    const std::string program = has_command ? "ftcs " + name : "ftcs";
    fmt::print(stderr, "{}: {} (see {} --help)\n", program, complaint(app, error), program);
    return kUsageError;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int exit_code = run({argv + std::min(argc, 1), argv + argc});
    // What was printed may still lie in a buffer: a full disk shows only here.
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
    fmt::print(stderr, "ftcs: cannot write to standard output\n");
    return ftcs::app::kRuntimeError;
  } catch (const std::exception& error) {
    fmt::print(stderr, "ftcs: {}\n", error.what());
    return ftcs::app::kRuntimeError;
  }
}
