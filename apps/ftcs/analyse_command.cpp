// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/number_check.h"
#include "apps/ftcs/output.h"
#include "ftcs/record/series_reader.h"
#include "ftcs/record/units.h"
#include "ftcs/report/record_report.h"

namespace ftcs::app {
namespace {

struct AnalyseOptions {
  std::string file;
  SeriesOptions series;
  std::string kind;
  double interval_s = 0.0;
  AnalysisOptions analysis;
  std::string taus = "octave";
  std::vector<std::string> deviations;
  std::string json;
  std::string csv;
  std::string html;
  bool quiet = false;
};

RecordKind kind_named(const std::string& word) {
  if (word == "frequency") return RecordKind::kFrequency;
  return word == "offset" ? RecordKind::kOffset : RecordKind::kPhase;
}

/// "octave", "decade", "all", or averaging times in seconds: "1,10,100". Says what is wrong.
std::string read_taus(const std::string& text, AnalysisOptions& analysis) {
  if (text == "octave") analysis.factors = octave_factors;
  if (text == "decade") analysis.factors = decade_factors;
  if (text == "all") analysis.factors = all_factors;
  if (text == "octave" || text == "decade" || text == "all") return "";
  for (const std::string& word : CLI::detail::split(text, ',')) {
    double tau_s = 0.0;
    if (!CLI::detail::lexical_cast(word, tau_s) || !(tau_s > 0.0) || !std::isfinite(tau_s)) {
      return fmt::format(
          "--taus is octave, decade, all or times in seconds such as 1,10,100; got {}", text);
    }
    analysis.taus_s.push_back(tau_s);
  }
  return "";
}

std::string read_deviations(const std::vector<std::string>& words, AnalysisOptions& analysis) {
  if (!words.empty()) analysis.deviations.clear();
  for (const std::string& word : words) {
    const auto deviation = deviation_named(word);
    if (deviation) {
      analysis.deviations.push_back(*deviation);
    } else if (word == "all") {
      const auto all = all_deviations();
      analysis.deviations.assign(all.begin(), all.end());
    } else {
      std::string known;
      for (const Deviation each : all_deviations()) known += fmt::format(", {}", name(each));
      return fmt::format("--deviation is all or one of {} in small letters; got {}",
                         known.substr(2), word);
    }
  }
  return "";
}

std::string check_time_unit(const std::string& text) {
  return seconds_of_unit(text) ? "" : "expected one of s, ms, us, ns, ps, d, got " + text;
}

std::string check_unit(const std::string& text) {
  if (seconds_of_unit(text) || fraction_of_unit(text) || hertz_of_unit(text)) return "";
  return "expected one of s, ms, us, ns, ps, d, 1, ppm, ppb, ppt, Hz, kHz, MHz, GHz, got " + text;
}

/// Empty: a figure came of one of the averaging times that were asked for.
std::string no_fitting_tau(const AnalyseOptions& options, const AnalysedRecord& record) {
  if (options.analysis.taus_s.empty() || !stability_list(record).rows().empty()) return "";
  const auto& series = record.series;
  return fmt::format("{}: --taus {}: none fits the record of {} values, one in {:g} s",
                     options.file, options.taus, series.values.size(), series.interval_s);
}

int analyse(AnalyseOptions options) {
  for (const std::string& wrong : {read_taus(options.taus, options.analysis),
                                   read_deviations(options.deviations, options.analysis)}) {
    if (wrong.empty()) continue;
    fmt::print(stderr, "ftcs analyse: {}\n", wrong);
    return kUsageError;
  }
  if (!options.kind.empty()) options.series.kind = kind_named(options.kind);
  if (options.interval_s > 0.0) options.series.interval_s = options.interval_s;
  const int refused =
      check_results({{"--json", options.json}, {"--csv", options.csv}, {"--html", options.html}},
                    {{"FILE", options.file}});
  if (refused != kSuccess) return refused;
  auto series = read_series(options.file, options.series);
  if (!series) {
    fmt::print(stderr, "ftcs: {}\n", series.error().text());
    return kRuntimeError;
  }
  const AnalysedRecord record = analyse_series(options.file, std::move(*series), options.analysis);
  if (const std::string wrong = no_fitting_tau(options, record); !wrong.empty()) {
    fmt::print(stderr, "ftcs: {}\n", wrong);
    return kRuntimeError;
  }
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
                   "text, CSV, log of ptp4l, phc2sys or chrony, also gzip; - = standard input")
      ->required();
  command->add_option("--column", options->series.column, "values: number from 1, or heading");
  command->add_option("--time-column", options->series.time_column,
                      "times: number, heading, or none");
  command->add_option("--time-unit", options->series.time_unit, "s, ms, us, ns, ps, d (default: s)")
      ->check(check_time_unit);
  command
      ->add_option("--kind", options->kind, "what the values are (default: by heading, else phase)")
      ->check(CLI::IsMember({"phase", "frequency", "offset"}));
  command
      ->add_option(
          "--unit", options->series.unit,
          "s, ms, us, ns, ps; of frequency 1, ppm, ppb, ppt, or Hz, kHz, MHz, GHz with --nominal "
          "(default: by heading and kind)")
      ->check(check_unit);
  command
      ->add_option("--nominal", options->series.nominal_hz,
                   "frequency in Hz that a record in Hz should have: 10e6")
      ->check(number_from(1e-12, 1e18));
  command->add_option("--source", options->series.source,
                      "of a log of several programs or clocks: which, as in 'phc2sys eth1'");
  command
      ->add_option("--interval", options->interval_s,
                   "seconds between values (default: from the times, else 1)")
      ->check(number_from(1e-12, 1e18));
  command->add_option(
      "--taus", options->taus,
      "octave (1, 2, 4, ... intervals), decade (1, 2, 4, 10, ...), all, or seconds: 1,10,100");
  command
      ->add_option(
          "--deviation", options->deviations,
          "oadev, mdev, ohdev, tdev (these by default), adev, hdev, totdev, mtotdev, ttotdev, "
          "htotdev, all; the first has the interval in the table")
      ->delimiter(',');
  command
      ->add_option("--confidence", options->analysis.confidence,
                   "of the intervals (default: 0.683)")
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
