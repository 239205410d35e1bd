// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <fmt/format.h>

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
  std::string source;  ///< of a log with several programs or clocks
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

/// A servo that a replay does not have: the bound needs to know the noise, which no record tells.
bool knows_servos(const std::vector<std::string>& wanted) {
  const auto known = experiment::replay_servo_names();
  for (const std::string& name : wanted) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    fmt::print(stderr, "ftcs: --servo {}: a replay has {}\n", name, fmt::join(known, ", "));
    return false;
  }
  return true;
}

int compare_log(const CompareOptions& options) {
  const SweepOptions& files = options.sweep;
  std::vector<std::string> names = files.servos;
  const auto libraries = load_servos(names);
  if (!knows_servos(names)) return kUsageError;
  const int refused = check_sweep_results(files, {{"--log", options.log}});
  if (refused != kSuccess) return refused;
  auto log = read_recorded_log(options.log, options.source);
  if (!log) {
    fmt::print(stderr, "ftcs: {}\n", log.error().text());
    return kRuntimeError;
  }
  LogComparison comparison{options.log, std::move(*log), {}};
  comparison.servos = experiment::replay_log(comparison.log, names, libraries);
  if (!options.sweep.quiet) fmt::print("{}", log_console(comparison));
  say_doubts(libraries);
  bool written =
      files.json.empty() || write_result(files.json, dump(log_json(comparison, FTCS_VERSION)));
  written &= files.csv.empty() || write_result(files.csv, log_table(comparison).to_csv());
  written &= files.html.empty() || write_result(files.html, log_html(comparison, FTCS_VERSION));
  written &= files.trace.empty() || write_result(files.trace, log_trace_csv(comparison));
  return written ? kSuccess : kRuntimeError;
}

int compare(const CompareOptions& options) {
  if (!options.log.empty()) return compare_log(options);
  if (!options.file.empty()) {
    const SweepSource source{options.file, {{"FILE", options.file}}};
    return run_and_report(experiment::load_scenarios(options.file), source, options.sweep);
  }
  const ExperimentFolder folder = find_experiments(options.suite.empty() ? "peers" : options.suite);
  std::vector<experiment::Scenario> scenarios = parse_all(folder.files);
  if (options.suite.empty()) {
    std::erase_if(scenarios,
                  [](const experiment::Scenario& s) { return s.name != kDefaultScenario; });
  }
  return run_and_report(std::move(scenarios), {folder.origin, inputs_of(folder, "--suite")},
                        options.sweep);
}

struct SimulateOptions {
  std::vector<std::string> files;
  SweepOptions sweep;
};

int simulate(const SimulateOptions& options) {
  std::vector<experiment::Scenario> scenarios;
  SweepSource source;
  for (const std::string& file : options.files) {
    for (auto& scenario : experiment::load_scenarios(file))
      scenarios.push_back(std::move(scenario));
    source.name += (source.name.empty() ? "" : " ") + file;
    source.files.push_back({"FILE", file});
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
  auto* suite =
      command->add_option("--suite", options->suite,
                          "all scenario files of a folder, or a built-in suite: peers, networks");
  suite->excludes(file);
  auto* log = command->add_option(
      "--log", options->log,
      "replay a log instead: ptp4l, phc2sys, chrony tracking or measurements, CSV of "
      "t1..t4 or of offsets; also gzip; - = standard input");
  log->excludes(file)->excludes(suite);
  command
      ->add_option("--source", options->source,
                   "of a log of several programs or clocks: which, as in 'phc2sys CLOCK_REALTIME'")
      ->needs(log);
  add_sweep_options(*command, options->sweep);
  // A record is one run of one world: there is nothing to draw, to share or to join.
  for (const char* name :
       {"--seeds", "--first-seed", "--medians-only", "--threads", "--shard", "--merge"}) {
    log->excludes(command->get_option(name));
  }
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
