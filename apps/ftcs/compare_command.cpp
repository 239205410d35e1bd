// SPDX-License-Identifier: MIT
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/experiment_files.h"
#include "apps/ftcs/output.h"
#include "apps/ftcs/sweep_options.h"
#include "ftcs/experiment/scenario.h"
#include "ftcs/experiment/scenario_error.h"
#include "ftcs/report/log_report.h"

namespace ftcs::app {
namespace {

struct CompareOptions {
  std::string file;
  std::string suite;
  std::string log;
  SweepOptions sweep;
};

/// What `ftcs compare` shows when it is given nothing: the first row of the peers' table.
constexpr const char* kDefaultScenario = "010-g100-1s-step";

std::vector<experiment::Scenario> parse_all(const std::vector<ExperimentFile>& files) {
  std::vector<experiment::Scenario> scenarios;
  for (const ExperimentFile& file : files) {
    for (auto& scenario : experiment::parse_scenarios(file.text, file.path))
      scenarios.push_back(std::move(scenario));
  }
  return scenarios;
}

int compare_log(const CompareOptions& options) {
  const SweepOptions& files = options.sweep;
  if (!can_write_results({files.json, files.csv, files.html})) return kRuntimeError;
  auto log = experiment::read_recorded_log(options.log);
  if (!log) {
    fmt::print(stderr, "ftcs: {}\n", log.error().text());
    return kRuntimeError;
  }
  LogComparison comparison{options.log, std::move(*log), {}};
  comparison.servos = experiment::replay_log(comparison.log);
  if (!options.sweep.quiet) fmt::print("{}", log_console(comparison));
  bool written =
      files.json.empty() || write_result(files.json, dump(log_json(comparison, FTCS_VERSION)));
  written &= files.csv.empty() || write_result(files.csv, log_table(comparison).to_csv());
  written &= files.html.empty() || write_result(files.html, log_html(comparison, FTCS_VERSION));
  return written ? kSuccess : kRuntimeError;
}

int compare(const CompareOptions& options) {
  if (!options.log.empty()) return compare_log(options);
  if (!options.file.empty()) {
    return run_and_report(experiment::load_scenarios(options.file), options.file, options.sweep);
  }
  const ExperimentFolder folder = find_experiments(options.suite.empty() ? "peers" : options.suite);
  std::vector<experiment::Scenario> scenarios = parse_all(folder.files);
  if (options.suite.empty()) {
    std::erase_if(scenarios,
                  [](const experiment::Scenario& s) { return s.name != kDefaultScenario; });
  }
  return run_and_report(std::move(scenarios), folder.origin, options.sweep);
}

struct SimulateOptions {
  std::vector<std::string> files;
  SweepOptions sweep;
};

int simulate(const SimulateOptions& options) {
  std::vector<experiment::Scenario> scenarios;
  std::string source;
  for (const std::string& file : options.files) {
    for (auto& scenario : experiment::load_scenarios(file))
      scenarios.push_back(std::move(scenario));
    source += (source.empty() ? "" : " ") + file;
  }
  return run_and_report(std::move(scenarios), source, options.sweep);
}

/// A mistake in a scenario file is the user's, as a wrong flag is.
template <class Command, class Options>
int guarded(Command command, const Options& options) {
  try {
    return command(options);
  } catch (const experiment::ScenarioError& error) {
    fmt::print(stderr, "ftcs: {}\n", error.what());
    return kUsageError;
  }
}

}  // namespace

void add_compare_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command = app.add_subcommand(
      "compare", "All servos on the same packets, ranked against the Kalman bound");
  auto* file = command->add_option("FILE", options->file,
                                   "scenario (TOML); default: gaussian 100 ns at 1 s");
  command
      ->add_option("--suite", options->suite,
                   "all scenario files of a folder, or a built-in suite: peers")
      ->excludes(file);
  command
      ->add_option("--log", options->log,
                   "replay a log instead: ptp4l, phc2sys, chrony tracking or measurements, CSV of "
                   "t1..t4 or of "
                   "offsets; also gzip; - = standard input")
      ->excludes(file);
  add_sweep_options(*command, options->sweep);
  command->callback([options, &exit_code] { exit_code = guarded(compare, *options); });
}

void add_simulate_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* command = app.add_subcommand("simulate", "Run scenario files and judge their limits");
  command->add_option("FILE", options->files, "scenarios (TOML)")->required();
  add_sweep_options(*command, options->sweep);
  command->callback([options, &exit_code] { exit_code = guarded(simulate, *options); });
}

}  // namespace ftcs::app
