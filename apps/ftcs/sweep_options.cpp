// SPDX-License-Identifier: MIT
#include "apps/ftcs/sweep_options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <fmt/format.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/output.h"
#include "apps/ftcs/progress.h"
#include "ftcs/experiment/log_replay.h"
#include "ftcs/experiment/scenario_error.h"
#include "ftcs/experiment/scenario_servos.h"
#include "ftcs/experiment/toml_table.h"
#include "ftcs/platform/interrupt.h"
#include "ftcs/report/sweep_report.h"
#include "ftcs/report/trace_plots.h"

namespace ftcs::app {
namespace {

using experiment::Scenario;
using experiment::SweepResult;

/// "2/8": the second of eight parts.
std::optional<experiment::Shard> parse_shard(const std::string& text) {
  const auto slash = text.find('/');
  std::size_t index = 0;
  std::size_t count = 0;
  const char* middle = text.data() + (slash == std::string::npos ? 0 : slash);
  const char* end = text.data() + text.size();
  const bool read = slash != std::string::npos &&
                    std::from_chars(text.data(), middle, index).ptr == middle &&
                    std::from_chars(middle + 1, end, count).ptr == end;
  if (!read || index < 1 || index > count) return std::nullopt;
  return experiment::Shard{index - 1, count};
}

/// A name that no scenario has is misspelt: it would leave tables without that row.
void refuse_unknown(const std::vector<std::string>& names, const std::vector<Scenario>& scenarios) {
  std::vector<std::string> known;
  for (const Scenario& scenario : scenarios) {
    for (const auto& servo : scenario.servos) {
      if (std::find(known.begin(), known.end(), servo.name) == known.end())
        known.push_back(servo.name);
    }
  }
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw experiment::ScenarioError(
          fmt::format("--servo {}: expected a file or one of {}", name, fmt::join(known, ", ")));
    }
  }
}

/// Returns the servos that somebody else wrote.
ServoLibraries apply(const SweepOptions& options, std::vector<Scenario>& scenarios) {
  std::vector<std::string> names = options.servos;
  auto libraries = load_servos(names);
  refuse_unknown(names, scenarios);
  for (Scenario& scenario : scenarios) {
    if (options.medians_only && scenario.fresh_seeds != 0) scenario.seeds = scenario.fresh_seeds;
    if (options.seeds != 0) scenario.seeds = options.seeds;
    if (options.first_seed != 0) scenario.first_seed = options.first_seed;
    if (!options.servos.empty()) {
      std::erase_if(scenario.servos, [&](const experiment::ScenarioServo& servo) {
        return std::find(names.begin(), names.end(), servo.name) == names.end() &&
               !experiment::is_bound(servo.name);
      });
    }
    for (const auto& library : libraries) {
      scenario.servos.insert(scenario.servos.begin(),
                             experiment::external_servo(library, scenario));
    }
    if (!options.medians_only) continue;
    for (auto& limit : scenario.limits) {
      for (auto& figure : limit.figures)
        figure.worst = figure.within = figure.worst_of_bound = experiment::FigureLimit::kNoLimit;
    }
  }
  return libraries;
}

SweepResult merge(const std::vector<Scenario>& scenarios, const std::vector<std::string>& files) {
  std::vector<SweepResult> parts;
  for (const std::string& file : files) {
    try {
      parts.push_back(sweep_from_json(Json::parse(experiment::read_text_file(file)), scenarios));
    } catch (const std::exception& error) {
      throw std::runtime_error(
          fmt::format("{}: not a result of --shard on these scenarios: {}", file, error.what()));
    }
  }
  return experiment::merge_sweeps(scenarios, parts);
}

std::size_t runs_of(const std::vector<Scenario>& scenarios) {
  std::size_t runs = 0;
  for (const Scenario& scenario : scenarios) runs += scenario.servos.size() * scenario.seeds;
  return runs;
}

std::size_t runs_in(const SweepResult& sweep) {
  std::size_t runs = 0;
  for (const auto& scenario : sweep.scenarios) {
    for (const auto& servo : scenario.servos) runs += servo.runs.size();
  }
  return runs;
}

void print(const std::vector<Scenario>& scenarios, const SweepResult& sweep) {
  for (std::size_t i = 0; i < scenarios.size(); ++i) {
    const Scenario& scenario = scenarios[i];
    const auto& servos = sweep.scenarios[i].servos;
    if (std::all_of(servos.begin(), servos.end(), [](const auto& row) { return row.runs.empty(); }))
      continue;
    fmt::print(
        "{}: {}\n{} seeds from {} on, median over seeds; true time error over the measurement "
        "window\n\n{}\n",
        scenario.name, scenario.title, scenario.seeds, scenario.first_seed,
        ranking_table(sweep.scenarios[i]).to_text());
    for (const auto& note : scenario.notes) fmt::print("{}\n", note);
    fmt::print("\n");
  }
}

/// The first seed of a single scenario, sample by sample; a suite has too many lines for one
/// picture.
std::vector<experiment::RunTrace> traces_of(const std::vector<Scenario>& scenarios,
                                            const std::atomic<bool>& stop) try {
  std::vector<experiment::RunTrace> traces;
  if (scenarios.size() != 1) return traces;
  for (const auto& servo : scenarios.front().servos) {
    traces.emplace_back();
    (void)experiment::run_scenario(scenarios.front(), servo, scenarios.front().first_seed,
                                   &traces.back(), &stop);
  }
  return traces;
} catch (const experiment::Interrupted&) {
  return {};
}

}  // namespace

ServoLibraries load_servos(std::vector<std::string>& servos) {
  ServoLibraries libraries;
  std::vector<std::string> names = experiment::replay_servo_names();
  names.emplace_back(experiment::kBoundName);
  for (const std::string& servo : servos) {
    if (!experiment::ServoLibrary::is_path(servo)) continue;
    auto library = std::make_shared<const experiment::ServoLibrary>(servo);
    if (std::find(names.begin(), names.end(), library->name()) != names.end()) {
      throw std::runtime_error(
          fmt::format("--servo {}: calls itself {}, as another servo of the table does", servo,
                      library->name()));
    }
    names.push_back(library->name());
    libraries.push_back(std::move(library));
  }
  std::erase_if(servos, &experiment::ServoLibrary::is_path);
  return libraries;
}

void say_doubts(const ServoLibraries& libraries) {
  for (const auto& library : libraries) {
    if (const std::string doubt = library->doubt(); !doubt.empty())
      fmt::print(stderr, "ftcs: {}\n", doubt);
  }
}

void add_sweep_options(CLI::App& command, SweepOptions& options) {
  command.add_option("--seeds", options.seeds, "runs of each servo (default: in the file)")
      ->check(CLI::Range(1, 1'000'000));
  command.add_option("--first-seed", options.first_seed, "(default: in the file)");
  command
      .add_option(
          "--servo", options.servos,
          "only this servo (and the bound), again for each more; a file is your own: .so or .py")
      ->allow_extra_args(false);  // what follows its name is a scenario
  command.add_flag("--medians-only", options.medians_only,
                   "do not judge worst seeds and shares (for fresh seeds)");
  command.add_option("--threads", options.threads, "0 = one for each core");
  auto* shard =
      command.add_option("--shard", options.shard, "i/n: compute one of n parts; needs --json")
          ->check([](const std::string& text) {
            return parse_shard(text) ? "" : "expected i/n with 1 <= i <= n, got " + text;
          });
  command.add_option("--merge", options.merge,
                     "join the --json files of all shards instead of computing");
  shard->needs(command.add_option("--json", options.json,
                                  "write all figures to this file; - = standard output"));
  command.add_option("--csv", options.csv, "write the table to this file");
  command.add_option("--html", options.html, "write a report to this file");
  command.add_option("--trace", options.trace,
                     "write every sample of the first seed to this file (CSV; one scenario only)");
  command.add_flag("-q,--quiet", options.quiet, "print nothing to the console");
}

int check_sweep_results(const SweepOptions& options, std::vector<NamedFile> inputs) {
  for (const std::string& servo : options.servos) {
    if (experiment::ServoLibrary::is_path(servo)) inputs.push_back({"--servo", servo});
  }
  for (const std::string& part : options.merge) inputs.push_back({"--merge", part});
  return check_results({{"--json", options.json},
                        {"--csv", options.csv},
                        {"--html", options.html},
                        {"--trace", options.trace}},
                       inputs);
}

int run_and_report(std::vector<Scenario> scenarios, const SweepSource& source,
                   const SweepOptions& options) {
  const ServoLibraries own = apply(options, scenarios);
  if (!options.trace.empty() && scenarios.size() != 1) {
    throw std::runtime_error(
        fmt::format("--trace follows one scenario, {} were given", scenarios.size()));
  }
  const experiment::Shard shard = parse_shard(options.shard).value_or(experiment::Shard{});
  if (const int refused = check_sweep_results(options, source.files); refused != kSuccess)
    return refused;
  const platform::Interrupt interrupt;
  SweepResult sweep;
  if (!options.merge.empty()) {
    sweep = merge(scenarios, options.merge);
  } else {
    Progress progress;
    experiment::JobControl control;
    control.threads = options.threads;
    control.stop = &interrupt.flag();
    control.progress = [&](std::size_t done, std::size_t total) { progress.show(done, total); };
    sweep = experiment::run_sweep(scenarios, shard, control);
  }
  if (interrupt.flag()) {
    const std::string gaps = unjudged(sweep);
    fmt::print(stderr, "ftcs: interrupted; the figures are of the finished runs{}{}\n",
               gaps.empty() ? "" : "; ", gaps);
  }
  if (!options.quiet) print(scenarios, sweep);
  say_doubts(own);
  // Also of a quiet run: a verdict without its reason helps nobody.
  const bool judged = shard.count == 1;
  if (judged) {
    for (const auto& line : missed_limits(sweep)) fmt::print(stderr, "MISSED {}\n", line);
  }
  if (!options.merge.empty() && !sweep.complete) {
    fmt::print(stderr, "ftcs: {} of {} runs are missing: are all shards there?\n",
               runs_of(scenarios) - runs_in(sweep), runs_of(scenarios));
  }
  const SweepOrigin origin{source.name, FTCS_VERSION};
  bool written =
      options.json.empty() || write_result(options.json, dump(sweep_json(sweep, origin, true)));
  written &= options.csv.empty() || write_result(options.csv, suite_table(sweep).to_csv());
  if (!options.html.empty() || !options.trace.empty()) {
    const auto traces = traces_of(scenarios, interrupt.flag());
    written &=
        options.html.empty() || write_result(options.html, sweep_html(sweep, origin, traces));
    written &= options.trace.empty() || write_result(options.trace, trace_csv(traces));
  }
  return written && !interrupt.flag() && (!judged || sweep.passed()) ? kSuccess : kRuntimeError;
}

}  // namespace ftcs::app
