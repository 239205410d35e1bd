// SPDX-License-Identifier: MIT
#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"

namespace {

int run(int argc, char** argv) {
  using namespace ftcs::app;
  CLI::App app{"Clocks that follow other clocks: frequency-tracking clock servos over PTP", "ftcs"};
  app.set_version_flag("-v,--version", "ftcs " FTCS_VERSION);
  app.require_subcommand(1);
  int exit_code = kSuccess;
  add_analyse_command(app, exit_code);
  add_demo_command(app, exit_code);
  add_compare_command(app, exit_code);
  add_ethercat_command(app, exit_code);
  add_ethercat_segment_command(app, exit_code);
  add_paper_command(app, exit_code);
  add_phc_command(app, exit_code);
  add_ptp_command(app, exit_code);
  add_simulate_command(app, exit_code);
  add_status_command(app, exit_code);
  const auto is_command = [&app](const std::string& name) {
    return !app.get_subcommands([&](CLI::App* command) { return command->check_name(name); })
                .empty();
  };
  const bool has_command = argc > 1 && is_command(argv[1]);
  if (argc > 1 && argv[1][0] != '-' && !has_command) {
    fmt::print(stderr, "ftcs: unknown command '{}' (see ftcs --help)\n", argv[1]);
    return kUsageError;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help, --version
    return app.exit(request);
  } catch (const CLI::Error& error) {
    const std::string name = has_command ? fmt::format("ftcs {}", argv[1]) : "ftcs";
    fmt::print(stderr, "{}: {} (see {} --help)\n", name, error.what(), name);
    return kUsageError;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int exit_code = run(argc, argv);
    // What was printed may still lie in a buffer: a full disk shows only here.
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
    fmt::print(stderr, "ftcs: cannot write to standard output\n");
    return ftcs::app::kRuntimeError;
  } catch (const std::exception& error) {
    fmt::print(stderr, "ftcs: {}\n", error.what());
    return ftcs::app::kRuntimeError;
  }
}
