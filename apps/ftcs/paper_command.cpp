// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/experiment_files.h"
#include "apps/ftcs/output.h"
#include "apps/ftcs/progress.h"
#include "apps/ftcs/sweep_options.h"
#include "ftcs/fieldbus/contour_live.h"
#include "ftcs/platform/interrupt.h"
#include "ftcs/report/cycle_report.h"
#include "ftcs/report/paper_report.h"

namespace ftcs::app {
namespace {

struct PaperOptions {
  std::string section = "4";
  std::string folder = "paper";
  std::uint64_t seeds = 0;
  unsigned threads = 0;
  std::string json;
  std::string csv;
  std::string html;
  std::vector<std::string> servos;  ///< files: servos of one's own
  std::uint64_t machine_seeds = 3;
  bool quiet = false;
  bool live = false;
};

/// Fewer would not carry the tolerances (1.5 % of an ensemble).
constexpr std::uint64_t kFewestSeeds = 256;

std::vector<experiment::PaperTable> load_tables(const PaperOptions& options) {
  std::vector<experiment::PaperTable> tables;
  for (const ExperimentFile& file : find_experiments(options.folder).files) {
    experiment::PaperTable table = experiment::parse_paper_table(file.text, file.path);
    if (options.seeds != 0) table.seeds = options.seeds;
    tables.push_back(std::move(table));
  }
  return tables;
}

std::vector<NamedFile> inputs(const PaperOptions& options) {
  if (options.section != "4") return {};
  auto files = inputs_of(find_experiments(options.folder), "--experiments");
  for (const std::string& servo : options.servos) files.push_back({"--servo", servo});
  return files;
}

/// The last line. Nothing failed where a table is cut short: the rest of it was not judged.
void print_verdict(bool passed, bool interrupted, bool failed) {
  fmt::print("{}\n", passed ? "Every demanded tolerance holds."
                     : interrupted && !failed
                         ? "Interrupted: the demanded tolerances were not all judged."
                         : "A demanded tolerance does not hold.");
}

int reproduce(const PaperOptions& options) {
  std::vector<std::string> names = options.servos;
  const auto libraries = load_servos(names);
  if (!names.empty()) {
    fmt::print(stderr, "ftcs paper: --servo adds a servo of your own, a .so or .py file; got {}\n",
               names.front());
    return kUsageError;
  }
  const platform::Interrupt interrupt;
  std::vector<experiment::PaperResult> results;
  if (!options.quiet) fmt::print("{}\n", algorithm_text());
  for (auto& table : load_tables(options)) {
    if (interrupt.flag()) break;
    for (const auto& library : libraries) experiment::add_servo(table, library);
    Progress progress;
    experiment::JobControl control;
    control.threads = options.threads;
    control.stop = &interrupt.flag();
    control.progress = [&](std::size_t done, std::size_t total) { progress.show(done, total); };
    results.push_back(experiment::run_paper_table(table, control));
    if (!options.quiet) fmt::print("{}\n", paper_console(results.back()));
  }
  say_doubts(libraries);
  const bool passed = !interrupt.flag() && std::all_of(results.begin(), results.end(),
                                                       [](const auto& r) { return r.passed(); });
  if (interrupt.flag())
    fmt::print(stderr, "ftcs: interrupted; the figures are of the finished runs\n");
  print_verdict(passed, interrupt.flag(),
                std::any_of(results.begin(), results.end(),
                            [](const auto& r) { return r.complete && !r.passed(); }));
  bool written =
      options.json.empty() ||
      write_result(options.json, dump(paper_json(results, FTCS_VERSION, !interrupt.flag())));
  written &= options.csv.empty() || write_result(options.csv, paper_csv(results).to_csv());
  written &= options.html.empty() || write_result(options.html, paper_html(results, FTCS_VERSION));
  return written && passed ? kSuccess : kRuntimeError;
}

/// A run is short and its extremes scatter: more of them than Section IV needs.
constexpr std::uint64_t kSection5Seeds = 1024;

/// Section V: the cycle servo on a coarse timer, in simulated time.
int reproduce_section5(const PaperOptions& options) {
  const platform::Interrupt interrupt;
  Progress progress;
  experiment::JobControl control;
  control.threads = options.threads;
  control.stop = &interrupt.flag();
  control.progress = [&](std::size_t done, std::size_t total) { progress.show(done, total); };
  const std::uint64_t seeds = options.seeds != 0 ? options.seeds : kSection5Seeds;
  experiment::CycleResult result = experiment::run_table6(seeds, control);
  if (!interrupt.flag()) {
    control.progress = nullptr;
    experiment::add_contour(result, experiment::run_contours({}, 1, control));
    result.two_machines = experiment::run_two_machines_table({}, options.machine_seeds, control);
  }
  if (options.live && !interrupt.flag()) {
    platform::LinuxKernel kernel;
    auto live = daemon::run_live_contours(kernel, [&interrupt] { return interrupt.flag().load(); });
    if (!live) return kRuntimeError;
    result.live_contour = std::move(*live);
  }
  if (!options.quiet) fmt::print("{}\n", cycle_console(result));
  if (interrupt.flag())
    fmt::print(stderr, "ftcs: interrupted; the figures are of the finished runs\n");
  print_verdict(result.passed() && !interrupt.flag(), interrupt.flag(), false);
  bool written =
      options.json.empty() || write_result(options.json, dump(cycle_json(result, FTCS_VERSION)));
  written &= options.csv.empty() || write_result(options.csv, cycle_table(result).to_csv());
  written &= options.html.empty() || write_result(options.html, cycle_html(result, FTCS_VERSION));
  return written && result.passed() && !interrupt.flag() ? kSuccess : kRuntimeError;
}

}  // namespace

void add_paper_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PaperOptions>();
  CLI::App* command =
      app.add_subcommand("paper", "Regenerate the tables and figures of Chen et al. 2017");
  command
      ->add_option("--section", options->section,
                   "section of the paper: 4 (simulations) or 5 (EtherCAT, cycle timer)")
      ->check(CLI::IsMember({"4", "5"}));
  command->add_option("--experiments", options->folder,
                      "folder of the table files (default: built in)");
  command->add_option("--seeds", options->seeds, "runs of each row (default: in the files)")
      ->check(CLI::Range(kFewestSeeds, std::uint64_t{1'000'000}));
  command
      ->add_option("--machine-seeds", options->machine_seeds,
                   "section 5: runs of two machines on one time; default 3")
      ->check(CLI::Range(1, 1000));
  command->add_option("--servo", options->servos,
                      "section 4: a row more for a servo of your own, a .so or .py file");
  command->add_option("--threads", options->threads, "0 = one for each core");
  command->add_option("--json", options->json,
                      "write all figures to this file; - = standard output");
  command->add_option("--csv", options->csv, "write the tables to this file");
  command->add_option("--html", options->html, "write a report with plots to this file");
  command->add_flag("-q,--quiet", options->quiet, "print the verdict alone");
  command->add_flag("--live", options->live,
                    "section 5: draw the circle over a virtual link too, a minute");
  command->callback([options, &exit_code] {
    if (options->live && options->section != "5") {
      fmt::print(stderr, "ftcs paper: --live belongs to --section 5\n");
      exit_code = kUsageError;
      return;
    }
    if (!options->servos.empty() && options->section != "4") {
      fmt::print(stderr, "ftcs paper: --servo belongs to --section 4\n");
      exit_code = kUsageError;
      return;
    }
    exit_code = check_results(
        {{"--json", options->json}, {"--csv", options->csv}, {"--html", options->html}},
        inputs(*options));
    if (exit_code != kSuccess) return;
    exit_code = options->section == "5" ? reproduce_section5(*options) : reproduce(*options);
  });
}

}  // namespace ftcs::app
