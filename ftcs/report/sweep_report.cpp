// SPDX-License-Identifier: MIT
#include "ftcs/report/sweep_report.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "ftcs/report/html_report.h"
#include "ftcs/report/number_format.h"
#include "ftcs/report/trace_plots.h"

namespace ftcs {
namespace {

using experiment::FigureName;
using experiment::RunFigures;
using experiment::ScenarioResult;
using experiment::ServoResult;
using experiment::SweepResult;

double limit_of(const ServoResult& servo, const std::string& figure, const std::string& kind) {
  for (const auto& limit : servo.limits) {
    if (limit.figure == figure && limit.kind == kind) return limit.limit;
  }
  return RunFigures::kNone;
}

bool is_bound(const ServoResult& servo) { return experiment::is_bound(servo.servo); }

std::vector<const ServoResult*> ranked(const ScenarioResult& scenario) {
  std::vector<const ServoResult*> order;
  for (const auto& servo : scenario.servos) {
    if (!servo.runs.empty()) order.push_back(&servo);
  }
  std::stable_sort(order.begin(), order.end(), [](const ServoResult* a, const ServoResult* b) {
    if (is_bound(*a) != is_bound(*b)) return is_bound(*b);
    return a->median(&RunFigures::rms_time_error_ns) < b->median(&RunFigures::rms_time_error_ns);
  });
  return order;
}

/// A servo is judged once it and the bound, with which limits may compare it, have all their runs.
bool is_judged(const ScenarioResult& scenario, const ServoResult& servo) {
  const bool bound_is_there = std::all_of(
      scenario.servos.begin(), scenario.servos.end(),
      [&](const ServoResult& row) { return !is_bound(row) || scenario.has_all_runs_of(row); });
  return bound_is_there && scenario.has_all_runs_of(servo);
}

std::string verdict(const ScenarioResult& scenario, const ServoResult& servo) {
  if (!servo.has_limits) return "";
  if (!is_judged(scenario, servo)) return "not judged";
  if (servo.passed) return "ok";
  return servo.required ? "MISSED" : "missed (not required)";
}

/// An endless settling time is a word, not a number.
Cell cycles_cell(double cycles) {
  return std::isinf(cycles) ? Cell("never") : Cell::fixed(cycles, 2);
}

Json runs_json(const ServoResult& servo) {
  Json runs = Json::array();
  for (std::size_t i = 0; i < servo.runs.size(); ++i) {
    Json run{{"seed", servo.seeds[i]}};
    for (const FigureName& figure : experiment::figure_names()) {
      const double value = servo.runs[i].*figure.figure;
      // Infinite means never: null would be "does not apply" to a merge.
      run[std::string(figure.json)] = std::isinf(value) ? Json("never") : number(value);
    }
    runs.push_back(std::move(run));
  }
  return runs;
}

Json limits_json(const ServoResult& servo) {
  Json limits = Json::array();
  for (const auto& limit : servo.limits) {
    limits.push_back({{"figure", limit.figure},
                      {"kind", limit.kind},
                      {"limit", limit.limit},
                      {"measured", number(limit.measured)},
                      {"passed", limit.passed}});
  }
  return limits;
}

Json servo_json(const ScenarioResult& scenario, const ServoResult& servo, bool with_runs) {
  Json row{{"scenario", scenario.scenario}, {"servo", servo.servo}, {"runs", servo.runs.size()}};
  for (const FigureName& figure : experiment::figure_names()) {
    row[std::string(figure.json)] = number(servo.median(figure.figure));
  }
  row["worst_rms_ns"] = number(servo.worst(&RunFigures::rms_time_error_ns));
  row["worst_max_ns"] = number(servo.worst(&RunFigures::max_time_error_ns));
  row["worst_c5_cycles"] = number(servo.worst(&RunFigures::c5_cycles));
  const double within = limit_of(servo, "max_time_error", "within");
  row["share_within_max"] = nullptr;
  for (const auto& limit : servo.limits) {
    if (limit.figure == "max_time_error" && limit.kind == "within")
      row["share_within_max"] = limit.measured;
  }
  row["limit_share_within_max"] = number(within);
  row["limit_rms_ns"] = number(limit_of(servo, "rms_time_error", "median"));
  row["limit_worst_ns"] = number(limit_of(servo, "rms_time_error", "worst"));
  row["limit_max_ns"] = number(limit_of(servo, "max_time_error", "median"));
  row["limit_worst_max_ns"] = number(limit_of(servo, "max_time_error", "worst"));
  row["limit_c5_cycles"] = number(limit_of(servo, "c5_cycles", "median"));
  row["limits"] = limits_json(servo);
  row["required"] = servo.required;
  row["passed"] = servo.passed;
  row["note"] = servo.note;
  if (with_runs) row["runs_of"] = runs_json(servo);
  return row;
}

RunFigures run_from_json(const Json& json) {
  RunFigures run;
  for (const FigureName& figure : experiment::figure_names()) {
    const Json& value = json.at(std::string(figure.json));
    if (value.is_number()) run.*figure.figure = value.get<double>();
    if (value.is_string()) run.*figure.figure = std::numeric_limits<double>::infinity();
  }
  return run;
}

}  // namespace

Table ranking_table(const ScenarioResult& scenario) {
  Table table({"servo", "RMS TE / ns", "worst", "max |TE| / ns", "c5 / cycles", "first 10 / ns",
               "rate / ppb", "of bound", "limits"});
  const auto order = ranked(scenario);
  double bound = RunFigures::kNone;
  if (!order.empty() && is_bound(*order.back()))
    bound = order.back()->median(&RunFigures::rms_time_error_ns);
  for (const ServoResult* servo : order) {
    const double rms = servo->median(&RunFigures::rms_time_error_ns);
    table.add_row({servo->servo, Cell::significant(rms),
                   Cell::significant(servo->worst(&RunFigures::rms_time_error_ns)),
                   Cell::significant(servo->median(&RunFigures::max_time_error_ns)),
                   cycles_cell(servo->median(&RunFigures::c5_cycles)),
                   Cell::significant(servo->median(&RunFigures::rms_first_ten_ns)),
                   Cell::significant(servo->median(&RunFigures::rate_error_ppb), 3),
                   Cell::fixed(rms / bound, 2), verdict(scenario, *servo)});
  }
  return table;
}

Table suite_table(const SweepResult& sweep) {
  Table table({"scenario", "servo", "runs", "RMS TE / ns", "limit", "worst", "limit",
               "max |TE| / ns", "c5 / cycles", "verdict"});
  for (const ScenarioResult& scenario : sweep.scenarios) {
    for (const ServoResult* servo : ranked(scenario)) {
      table.add_row({scenario.scenario, servo->servo, Cell::count(servo->runs.size()),
                     Cell::significant(servo->median(&RunFigures::rms_time_error_ns)),
                     Cell::significant(limit_of(*servo, "rms_time_error", "median"), 3),
                     Cell::significant(servo->worst(&RunFigures::rms_time_error_ns)),
                     Cell::significant(limit_of(*servo, "rms_time_error", "worst"), 3),
                     Cell::significant(servo->median(&RunFigures::max_time_error_ns)),
                     cycles_cell(servo->median(&RunFigures::c5_cycles)),
                     verdict(scenario, *servo)});
    }
  }
  return table;
}

std::vector<std::string> missed_limits(const SweepResult& sweep) {
  std::vector<std::string> lines;
  for (const ScenarioResult& scenario : sweep.scenarios) {
    for (const ServoResult& servo : scenario.servos) {
      if (!is_judged(scenario, servo)) continue;
      for (const auto& limit : servo.limits) {
        if (limit.passed) continue;
        lines.push_back(fmt::format("{}: {}: {} of {} is {}, limit {}{}", scenario.scenario,
                                    servo.servo, limit.kind, limit.figure,
                                    significant(limit.measured), significant(limit.limit),
                                    servo.required ? "" : " (not required)"));
      }
    }
  }
  return lines;
}

std::string unjudged(const SweepResult& sweep) {
  std::size_t cut_short = 0;
  std::size_t not_run = 0;
  for (const ScenarioResult& scenario : sweep.scenarios) {
    const auto has_none = [](const ServoResult& servo) { return servo.runs.empty(); };
    const auto has_all = [&](const ServoResult& servo) { return scenario.has_all_runs_of(servo); };
    if (std::all_of(scenario.servos.begin(), scenario.servos.end(), has_all)) continue;
    ++(std::all_of(scenario.servos.begin(), scenario.servos.end(), has_none) ? not_run : cut_short);
  }
  if (cut_short + not_run == 0) return "";
  return fmt::format("of {} scenarios, cut short: {}, not run: {}; these are not judged",
                     sweep.scenarios.size(), cut_short, not_run);
}

Json sweep_json(const SweepResult& sweep, const SweepOrigin& origin, bool with_runs) {
  Json rows = Json::array();
  for (const ScenarioResult& scenario : sweep.scenarios) {
    for (const ServoResult& servo : scenario.servos)
      rows.push_back(servo_json(scenario, servo, with_runs));
  }
  return Json{{"program", "ftcs"},        {"version", origin.version},
              {"source", origin.suite},   {"complete", sweep.complete},
              {"passed", sweep.passed()}, {"suite", std::move(rows)}};
}

SweepResult sweep_from_json(const Json& json, const std::vector<experiment::Scenario>& scenarios) {
  const Json& rows = json.at("suite");
  SweepResult result;
  std::size_t row = 0;
  for (const auto& scenario : scenarios) {
    ScenarioResult entry{scenario.name, scenario.title, {}, scenario.seeds};
    for (const auto& servo : scenario.servos) {
      const Json& from = rows.at(row++);
      if (from.at("scenario") != scenario.name || from.at("servo") != servo.name) {
        throw std::runtime_error("the result is of other scenarios or servos");
      }
      ServoResult runs;
      runs.servo = servo.name;
      for (const Json& run : from.at("runs_of")) {
        runs.seeds.push_back(run.at("seed").get<std::uint64_t>());
        runs.runs.push_back(run_from_json(run));
      }
      entry.servos.push_back(std::move(runs));
    }
    result.scenarios.push_back(std::move(entry));
  }
  if (row != rows.size()) throw std::runtime_error("the result is of other scenarios or servos");
  return result;
}

std::string sweep_html(const SweepResult& sweep, const SweepOrigin& origin,
                       const std::vector<experiment::RunTrace>& traces) {
  HtmlReport report("Clock servos compared", origin.suite);
  if (const std::string gaps = unjudged(sweep); !gaps.empty())
    report.add_note("Not complete: " + gaps, true);
  for (const std::string& line : missed_limits(sweep)) report.add_note(line, true);
  for (const ScenarioResult& scenario : sweep.scenarios) {
    report.add_table(scenario.scenario, ranking_table(scenario), scenario.title);
  }
  for (const Plot& plot : trace_plots(traces)) report.add_plot(plot);
  report.add_parameters({{"source", origin.suite}, {"version", origin.version}});
  return report.render();
}

}  // namespace ftcs
