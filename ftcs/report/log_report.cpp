// SPDX-License-Identifier: MIT
#include "ftcs/report/log_report.h"

#include <cmath>

#include <fmt/format.h>

#include "ftcs/report/html_report.h"

namespace ftcs {
namespace {

std::string usage_text(const experiment::RecordedLog& log) {
  return fmt::format(
      "{}: {} lines, {} used, {} not usable; {} pairs, one forward message in {:.6g} s", log.format,
      log.lines, log.used, log.unusable, log.pairs.size(), log.interval_s);
}

constexpr const char* kMeaning =
    "offset: measured before each update, the record's own noise included; second half of the "
    "record";

}  // namespace

Table log_table(const LogComparison& comparison) {
  Table table({"servo", "RMS TE / ns", "max |TE| / ns", "RMS offset / ns", "max / ns",
               "rate spread / ppb", "commands", "steps", "rejected"});
  for (const auto& servo : comparison.servos) {
    table.add_row({servo.servo, Cell::significant(servo.rms_time_error_ns),
                   Cell::significant(servo.max_time_error_ns),
                   Cell::significant(servo.rms_offset_ns), Cell::significant(servo.max_offset_ns),
                   Cell::significant(servo.rate_spread_ppb, 3), Cell::count(servo.commands),
                   Cell::count(servo.steps), Cell::count(servo.rejected)});
  }
  return table;
}

std::string log_console(const LogComparison& comparison) {
  const auto& log = comparison.log;
  std::string text = fmt::format("{}\n{}\n", comparison.file, usage_text(log));
  for (const auto& note : log.notes) text += note + "\n";
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
                {"two_way", log.two_way},
                {"lines", log.lines},
                {"used", log.used},
                {"unusable", log.unusable},
                {"unusable_examples", std::move(examples)},
                {"pairs", log.pairs.size()},
                {"interval_s", log.interval_s},
                {"truth", log.has_truth},
                {"notes", log.notes}}},
              {"servos", std::move(servos)}};
}

std::string log_html(const LogComparison& comparison, const std::string& version) {
  HtmlReport report("What would my clock have done?", comparison.file);
  report.add_table("Servos on this record", log_table(comparison), kMeaning);
  Plot plot;
  plot.title = "Measured offset of the steered clock";
  plot.x_label = "time / s";
  plot.y_label = "local minus reference / ns";
  for (const auto& servo : comparison.servos) {
    if (servo.servo != "none")
      plot.series.push_back({servo.servo, servo.time_s, servo.offset_ns, {}, {}});
  }
  report.add_plot(plot);
  report.add_note(usage_text(comparison.log));
  for (const auto& note : comparison.log.notes) report.add_note(note);
  for (const auto& line : comparison.log.examples) {
    report.add_note(fmt::format("line {} not used: {}", line.number, line.text), true);
  }
  report.add_parameters({{"file", comparison.file}, {"version", version}});
  return report.render();
}

}  // namespace ftcs
