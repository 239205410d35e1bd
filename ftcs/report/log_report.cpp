// SPDX-License-Identifier: MIT
#include "ftcs/report/log_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "ftcs/report/html_report.h"

namespace ftcs {
namespace {

std::vector<std::string> notes_of(const RecordedLog& log) {
  std::vector<std::string> notes = log.notes;
  notes.insert(notes.end(), log.replay_notes.begin(), log.replay_notes.end());
  return notes;
}

std::string usage_text(const RecordedLog& log) {
  return fmt::format(
      "{}: {} lines, {} used, {} not usable; {} pairs, one forward message in {:.6g} s", log.format,
      log.lines, log.used, log.unusable, log.pairs.size(), log.interval_s);
}

/// In lines of a terminal; what a browser folds by itself.
constexpr const char* kMeaning =
    "All figures are of the second half of the record.\n"
    "TE: true time error. Offset: measured before each update, the record's own noise included.\n"
    "Median and 95 %: of |TE| where the record tells the truth, else of |offset|.\n"
    "Within sigma: how often the estimate was within 1, 2, 3 of the deviations the servo stated.";

/// "68 / 95 / 99.7 %"; a gap where nothing can be judged.
std::string coverage_text(const std::array<double, 3>& within) {
  if (!std::isfinite(within[0])) return "-";
  return fmt::format("{:.0f} / {:.0f} / {:.1f} %", 100 * within[0], 100 * within[1],
                     100 * within[2]);
}

/// What the recorded clock's own servo commanded is not in the record.
Cell count_of(const experiment::ReplayResult& servo, std::uint64_t count) {
  return servo.servo == experiment::kAsRecorded ? Cell("-") : Cell::count(count);
}

/// Largest |value| from the middle of the record on: the half that is counted sets the scale, and
/// not the first second of a clock that began a millisecond away.
double counted_extent(const std::vector<double>& values) {
  double extent = 0.0;
  for (std::size_t i = values.size() / 2; i < values.size(); ++i)
    if (std::isfinite(values[i])) extent = std::max(extent, std::abs(values[i]));
  return extent;
}

/// One series of each servo that steers; `add` may put more beside it.
template <class Add>
Plot plot_of_servos(const LogComparison& comparison, std::string title,
                    std::vector<double> experiment::ReplayResult::*values, const Add& add) {
  Plot plot;
  plot.title = std::move(title);
  plot.x_label = "time / s";
  plot.y_label = "local minus reference / ns";
  for (const auto& servo : comparison.servos) {
    if (servo.servo == "none") continue;
    plot.series.push_back({servo.servo, servo.time_s, servo.*values, {}, {}});
    plot.y_extent = std::max(plot.y_extent, counted_extent(servo.*values));
    add(plot, servo);
  }
  return plot;
}

Plot offset_plot(const LogComparison& comparison) {
  Plot plot = plot_of_servos(comparison, "Measured offset of the steered clock",
                             &experiment::ReplayResult::offset_ns,
                             [](Plot&, const experiment::ReplayResult&) {});
  plot.note = "The scale is that of the second half, which is counted; the start may go beyond it.";
  return plot;
}

/// True error, and the deviation that the servo states: honest where the error stays between its
/// lines.
Plot error_plot(const LogComparison& comparison) {
  const auto add_stated = [](Plot& plot, const experiment::ReplayResult& servo) {
    const bool stated = std::any_of(servo.sigma_ns.begin(), servo.sigma_ns.end(),
                                    [](double sigma) { return std::isfinite(sigma); });
    for (const double side : {3.0, -3.0}) {
      if (!stated) continue;
      PlotSeries edge{
          fmt::format("{}, {:+.0f} sigma", servo.servo, side), servo.time_s, {}, {}, {}};
      for (const double sigma : servo.sigma_ns) edge.y.push_back(side * sigma);
      plot.y_extent = std::max(plot.y_extent, counted_extent(edge.y));
      plot.series.push_back(std::move(edge));
    }
  };
  return plot_of_servos(comparison, "True time error, with the stated deviation (3 sigma)",
                        &experiment::ReplayResult::time_error_ns, add_stated);
}

}  // namespace

Table log_table(const LogComparison& comparison) {
  Table table({"servo", "RMS TE / ns", "max |TE| / ns", "median / ns", "95 % / ns",
               "RMS offset / ns", "max / ns", "within 1, 2, 3 sigma", "rate spread / ppb",
               "commands", "steps", "rejected"});
  for (const auto& servo : comparison.servos) {
    table.add_row({servo.servo, Cell::significant(servo.rms_time_error_ns),
                   Cell::significant(servo.max_time_error_ns), Cell::significant(servo.median_ns),
                   Cell::significant(servo.percentile_95_ns),
                   Cell::significant(servo.rms_offset_ns), Cell::significant(servo.max_offset_ns),
                   coverage_text(servo.within_sigma), Cell::significant(servo.rate_spread_ppb, 3),
                   count_of(servo, servo.commands), count_of(servo, servo.steps),
                   count_of(servo, servo.rejected)});
  }
  return table;
}

std::string log_console(const LogComparison& comparison) {
  const auto& log = comparison.log;
  std::string text = fmt::format("{}\n{}\n", comparison.file, usage_text(log));
  for (const auto& note : notes_of(log)) text += note + "\n";
  for (const auto& line : log.examples)
    text += fmt::format("line {} not used: {}\n", line.number, line.text);
  if (!log.has_truth) text += "no truth column: ranked by the measured offset\n";
  return text + fmt::format("{}\n\n{}", kMeaning, log_table(comparison).to_text());
}

Json log_json(const LogComparison& comparison, const std::string& version) {
  const auto& log = comparison.log;
  Json examples = Json::array();
  for (const auto& line : log.examples)
    examples.push_back({{"line", line.number}, {"text", line.text}});
  Json servos = Json::array();
  for (const auto& servo : comparison.servos) {
    servos.push_back({{"servo", servo.servo},
                      {"samples", servo.samples},
                      {"rms_time_error_ns", number(servo.rms_time_error_ns)},
                      {"max_time_error_ns", number(servo.max_time_error_ns)},
                      {"median_ns", number(servo.median_ns)},
                      {"percentile_95_ns", number(servo.percentile_95_ns)},
                      {"within_1_sigma", number(servo.within_sigma[0])},
                      {"within_2_sigma", number(servo.within_sigma[1])},
                      {"within_3_sigma", number(servo.within_sigma[2])},
                      {"rms_offset_ns", number(servo.rms_offset_ns)},
                      {"max_offset_ns", number(servo.max_offset_ns)},
                      {"rate_spread_ppb", number(servo.rate_spread_ppb)},
                      {"commands", servo.commands},
                      {"steps", servo.steps},
                      {"rejected", servo.rejected}});
  }
  return Json{{"program", "ftcs"},
              {"version", version},
              {"log",
               {{"file", comparison.file},
                {"format", log.format},
                {"source", log.source},
                {"steered", log.steered},
                {"two_way", log.two_way},
                {"lines", log.lines},
                {"used", log.used},
                {"unusable", log.unusable},
                {"unusable_examples", std::move(examples)},
                {"pairs", log.pairs.size()},
                {"interval_s", log.interval_s},
                {"truth", log.has_truth},
                {"notes", notes_of(log)}}},
              {"servos", std::move(servos)}};
}

std::string log_html(const LogComparison& comparison, const std::string& version) {
  HtmlReport report("What would my clock have done?", comparison.file);
  report.add_table("Servos on this record", log_table(comparison), kMeaning);
  report.add_plot(offset_plot(comparison));
  if (comparison.log.has_truth) report.add_plot(error_plot(comparison));
  report.add_note(usage_text(comparison.log));
  for (const auto& note : notes_of(comparison.log)) report.add_note(note);
  for (const auto& line : comparison.log.examples) {
    report.add_note(fmt::format("line {} not used: {}", line.number, line.text), true);
  }
  report.add_parameters({{"file", comparison.file}, {"version", version}});
  return report.render();
}

std::string log_trace_csv(const LogComparison& comparison) {
  std::string text = "servo,time_s,offset_ns,time_error_ns,sigma_ns\n";
  const auto value = [](double x) {
    return std::isfinite(x) ? fmt::format("{}", x) : std::string();
  };
  for (const auto& servo : comparison.servos) {
    for (std::size_t i = 0; i < servo.time_s.size(); ++i) {
      text +=
          fmt::format("{},{},{},{},{}\n", servo.servo, servo.time_s[i], value(servo.offset_ns[i]),
                      value(servo.time_error_ns[i]), value(servo.sigma_ns[i]));
    }
  }
  return text;
}

}  // namespace ftcs
