// SPDX-License-Identifier: MIT
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/output.h"
#include "ftcs/record/series_reader.h"
#include "ftcs/report/record_report.h"

namespace ftcs::app {
namespace {

struct AnalyseOptions {
  std::string file;
  SeriesOptions series;
  std::string kind;
  double interval_s = 0.0;
  double confidence = kOneSigmaConfidence;
  std::string json;
  std::string csv;
  std::string html;
  bool quiet = false;
};

RecordKind kind_named(const std::string& word) {
  if (word == "frequency") return RecordKind::kFrequency;
  return word == "offset" ? RecordKind::kOffset : RecordKind::kPhase;
}

int analyse(AnalyseOptions options) {
  if (!options.kind.empty()) options.series.kind = kind_named(options.kind);
  if (options.interval_s > 0.0) options.series.interval_s = options.interval_s;
  if (!can_write_results({options.json, options.csv, options.html})) return kRuntimeError;
  auto series = read_series(options.file, options.series);
  if (!series) {
    fmt::print(stderr, "ftcs: {}\n", series.error().text());
    return kRuntimeError;
  }
  const AnalysedRecord record =
      analyse_series(options.file, std::move(*series), options.confidence);
  if (!options.quiet) fmt::print("{}", console_report(record));
  // Each is tried even if one before failed: a full disk must not cost the others.
  bool written = write_result(options.json, options.json.empty() ? "" : dump(json_report(record)));
  written &= write_result(options.csv, options.csv.empty() ? "" : stability_list(record).to_csv());
  written &= write_result(options.html, options.html.empty() ? "" : html_report(record));
  if (std::fflush(stdout) != 0) {
    fmt::print(stderr, "ftcs: cannot write to the standard output\n");
    written = false;
  }
  return written ? kSuccess : kRuntimeError;
}

}  // namespace

void add_analyse_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<AnalyseOptions>();
  CLI::App* command = app.add_subcommand(
      "analyse", "Stability figures and plots of a phase, frequency or offset record");
  command
      ->add_option("FILE", options->file,
                   "text, CSV, log of ptp4l or phc2sys, also gzip; - = standard input")
      ->required();
  command->add_option("--column", options->series.column, "values: number from 1, or heading");
  command->add_option("--time-column", options->series.time_column,
                      "times: number, heading, or none");
  command->add_option("--time-unit", options->series.time_unit,
                      "s, ms, us, ns, ps, d (default: s)");
  command
      ->add_option("--kind", options->kind, "what the values are (default: by heading, else phase)")
      ->check(CLI::IsMember({"phase", "frequency", "offset"}));
  command->add_option(
      "--unit", options->series.unit,
      "s, ms, us, ns, ps; of frequency 1, ppm, ppb, ppt (default: by heading and kind)");
  command->add_option("--source", options->series.source,
                      "of a log of several programs or clocks: which, as in 'phc2sys eth1'");
  command
      ->add_option("--interval", options->interval_s,
                   "seconds between values (default: from the times, else 1)")
      ->check(CLI::PositiveNumber);
  command->add_option("--confidence", options->confidence, "of the intervals (default: 0.683)")
      ->check([](const std::string& text) -> std::string {
        double value = 0.0;
        const bool valid = CLI::detail::lexical_cast(text, value) && value > 0.0 && value < 1.0;
        return valid ? "" : "expected a number between 0 and 1, got " + text;
      });
  command->add_option("--json", options->json,
                      "write all figures to this file; - = standard output");
  command->add_option("--csv", options->csv, "write the stability figures to this file");
  command->add_option("--html", options->html, "write a report with plots to this file");
  command->add_flag("-q,--quiet", options->quiet, "print nothing to the console");
  command->callback([options, &exit_code] { exit_code = analyse(*options); });
}

}  // namespace ftcs::app
