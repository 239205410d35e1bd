// SPDX-License-Identifier: MIT
#include "ftcs/report/cycle_report.h"

#include <fmt/format.h>

#include "ftcs/report/check_report.h"
#include "ftcs/report/html_report.h"
#include "ftcs/report/number_format.h"

namespace ftcs {
namespace {

using experiment::CycleResult;
using experiment::CycleRow;
using experiment::CycleSeedRun;

constexpr const char* kTitle = "Table 6: EtherCAT main device on a timer of 10 us";

Json row_json(const CycleResult& result, std::size_t i) {
  const CycleRow& row = result.rows[i];
  const CycleSeedRun& median = result.figures[i].median;
  return Json{{"row", row.name},
              {"paper_rms_ns", number(row.paper_rms_ns)},
              {"rms_perceived_offset_ns", number(median.rms_perceived_ns)},
              {"median_rms_ns", number(median.rms_perceived_ns)},
              {"std_perceived_offset_ns", number(median.deviation_perceived_ns)},
              {"min_ns", number(median.minimum_ns)},
              {"max_ns", number(median.maximum_ns)},
              {"rms_event_error_ns", number(median.rms_event_ns)},
              {"rms_virtual_error_ns", number(median.rms_virtual_ns)},
              {"rms_time_error_ns", number(median.rms_virtual_ns)},
              {"predicted_rms_ns", number(row.model_deviation_ns)},
              {"paper_cycles", number(row.paper_cycles)},
              {"cycles_to_converge", number(median.cycles)},
              {"passed", row_passed(result.checks, row.name)},
              {"note", row.note},
              {"model_rms_ns", number(row.model_rms_ns)},
              {"paper_min_ns", number(row.paper_min_ns)},
              {"paper_max_ns", number(row.paper_max_ns)},
              {"percentile_5_ns", number(result.figures[i].percentile_5_ns)},
              {"percentile_95_ns", number(result.figures[i].percentile_95_ns)},
              {"cycles_from_first_message", number(median.cycles_from_first_message)},
              {"runs", result.figures[i].runs.size()}};
}

Plot figure_plot(const CycleResult& result) {
  Plot plot;
  plot.title = "figure7: perceived error of the cycle, first seed";
  plot.x_label = "sync interval";
  plot.y_label = "early is positive / ns";
  for (const auto& trace : result.traces) {
    PlotSeries series;
    series.name = trace.row;
    for (std::size_t n = 0; n < trace.perceived_ns.size(); ++n) {
      series.x.push_back(static_cast<double>(n));
      series.y.push_back(trace.perceived_ns[n]);
    }
    plot.series.push_back(series);
  }
  return plot;
}

Json contour_json(const std::vector<experiment::ContourRow>& rows) {
  Json array = Json::array();
  for (const experiment::ContourRow& row : rows) {
    array.push_back({{"servo", row.servo},
                     {"rms_contour_error_um", number(row.rms_um)},
                     {"max_contour_error_um", number(row.max_um)},
                     {"missed_sync0_windows", row.missed_windows},
                     {"sync0_windows", row.windows},
                     {"first_fault_s", number(row.first_fault_s)},
                     {"missed_by_late_host", row.late_windows},
                     {"ended", row.ended}});
  }
  return array;
}

Json world_json(const experiment::ContourResult& contour) {
  const experiment::ContourWorld& world = contour.world;
  return {{"radius_um", world.radius_um},
          {"turn_s", world.turn_s},
          {"reference_ppm", world.reference_ppm},
          {"other_ppm", world.other_ppm},
          {"settling_s", world.settling_s},
          {"measured_s", world.measured_s},
          {"seed", contour.seed}};
}

Plot contour_plot(const char* title, const std::vector<experiment::ContourRow>& rows) {
  constexpr double kCycleS = 1e-3;
  Plot plot;
  plot.title = title;
  plot.x_label = "s";
  plot.y_label = "um";
  for (const experiment::ContourRow& row : rows) {
    plot.series.push_back(
        trace_series(row.servo, row.trace_um, experiment::ContourRow::kTraceGroup * kCycleS, 1.0));
  }
  plot.note = "Largest of each 20 cycles.";
  return plot;
}

std::string contour_method(const experiment::ContourWorld& world) {
  return fmt::format(
      "Two modelled drives draw a circle of {:g} mm radius in {:g} s a turn (counts of 1 um), "
      "cycle "
      "1 ms, SYNC0 half a cycle behind the frame, reference {:+g} ppm; {:g} s measured. Contour "
      "error: distance from the circle that the same position loops draw with no window missed. "
      "Windows: SYNC0 events of both drives; missed: without new outputs, the drives' own limit "
      "switched off. First fault: the same run with the limit as drives have it (0x001A). All "
      "three "
      "servos keep every window: they differ in how soon they lock and what they must be told, not "
      "on the circle.",
      world.radius_um * 1e-3, world.turn_s, world.reference_ppm, world.measured_s);
}

constexpr const char* kLiveMethod =
    "The same over a virtual link (UDP on loopback), reference +100 ppm, 12 s each. A host that "
    "wakes up late misses windows whatever the servo does: counted from the stamps of the frames.";

constexpr const char* kRemark =
    "RMS: of one run of 200 intervals, median over seeds. Perceived: what the servo saw. Event: "
    "the "
    "trigger on its tick; no servo can be under 10 us / sqrt(12) = 2887 ns. Virtual: the trigger "
    "without its tick.";

}  // namespace

Table cycle_table(const CycleResult& result) {
  Table table({"row", "paper RMS / ns", "RMS / ns", "std / ns", "min / ns", "max / ns",
               "event RMS / ns", "virtual RMS / ns", "cycles, paper", "cycles"});
  for (std::size_t i = 0; i < result.rows.size(); ++i) {
    const CycleSeedRun& median = result.figures[i].median;
    table.add_row({result.rows[i].name, Cell::significant(result.rows[i].paper_rms_ns),
                   Cell::significant(median.rms_perceived_ns),
                   Cell::significant(median.deviation_perceived_ns),
                   Cell::significant(median.minimum_ns), Cell::significant(median.maximum_ns),
                   Cell::significant(median.rms_event_ns), Cell::significant(median.rms_virtual_ns),
                   Cell::significant(result.rows[i].paper_cycles),
                   Cell::significant(median.cycles)});
  }
  return table;
}

Table contour_table(const std::vector<experiment::ContourRow>& rows) {
  Table table({"servo", "contour error, RMS / um", "largest / um", "missed SYNC0 windows", "of",
               "first fault of a drive / s", "missed by a late host", "ended early"});
  for (const experiment::ContourRow& row : rows) {
    table.add_row({row.servo, Cell::significant(row.rms_um, 3), Cell::significant(row.max_um, 3),
                   Cell::count(row.missed_windows), Cell::count(row.windows),
                   Cell::significant(row.first_fault_s, 3), Cell::count(row.late_windows),
                   row.ended});
  }
  return table;
}

Table two_machines_table(const experiment::TwoMachinesResult& result) {
  Table table({"mode", "SYNC0 against SYNC0, RMS / ns", "worst seed", "largest / ns",
               "contour error, RMS / um", "error of what is told, RMS / ns", "drive faults",
               "missed windows", "passed"});
  for (const experiment::TwoMachinesRow& row : result.rows) {
    const bool told = row.demanded_rms_ns > 0.0;
    table.add_row({experiment::name(row.mode), Cell::significant(row.median.sync0_rms_ns, 3),
                   Cell::significant(row.worst.sync0_rms_ns, 3),
                   Cell::significant(row.worst.sync0_worst_ns, 3),
                   Cell::significant(row.median.contour_rms_um, 3),
                   told ? Cell::significant(row.median.told_rms_ns, 3) : Cell{"-"},
                   Cell::count(row.worst.faults), Cell::count(row.worst.missed_windows),
                   row.passed ? "yes" : "no"});
  }
  return table;
}

std::string two_machines_method(const experiment::TwoMachinesResult& result) {
  const experiment::TwoMachinesWorld& world = result.world;
  return fmt::format(
      "Two hosts with crystals of their own, {} modelled drives on each (all crystals within ±{:g} "
      "ppm, random-walk FM of {:g} per square root of a second), one PTP grandmaster: Sync every "
      "{:g} ms, hardware stamps with ticks of {:g} ns. The hosts' stamps of their EtherCAT frames "
      "scatter by {:g} ns; frames are 20 to 200 us late. {} seeds, {:g} s from {:g} s on. The "
      "circle has x on one machine and y on the other. lead: bus shift; external: DCX; one: both "
      "axes on one machine. RMS: median over the seeds; largest: of all. A Kalman filter that "
      "knows all noises would reach {:.1f} ns.",
      experiment::TwoMachinesWorld::kDrives, world.crystal_ppm, world.wander,
      world.sync_interval_s * 1e3, world.stamp_tick_ns, world.frame_stamp_ns, result.seeds,
      world.measured_s, world.settling_s, result.kalman_rms_ns);
}

Json two_machines_json(const experiment::TwoMachinesResult& result) {
  Json rows = Json::array();
  for (const experiment::TwoMachinesRow& row : result.rows) {
    Json circle = Json::array();
    for (const experiment::CirclePoint& point : row.circle) {
      circle.push_back({number(point.angle_rad), number(point.error_um)});
    }
    rows.push_back({{"mode", experiment::name(row.mode)},
                    {"seeds", result.seeds},
                    {"sync0_rms_ns", number(row.median.sync0_rms_ns)},
                    {"sync0_rms_worst_seed_ns", number(row.worst.sync0_rms_ns)},
                    {"sync0_worst_ns", number(row.worst.sync0_worst_ns)},
                    {"contour_rms_um", number(row.median.contour_rms_um)},
                    {"contour_worst_um", number(row.worst.contour_worst_um)},
                    {"told_rms_ns", number(row.median.told_rms_ns)},
                    {"kalman_rms_ns", number(result.kalman_rms_ns)},
                    {"drive_faults", row.worst.faults},
                    {"missed_sync0_windows", row.worst.missed_windows},
                    {"circle", std::move(circle)},
                    {"passed", row.passed}});
  }
  return rows;
}

Plot two_machines_plot(const experiment::TwoMachinesResult& result) {
  Plot plot;
  plot.title = "One circle whose axes stand on two machines: how far it is off";
  plot.x_label = "angle / rad";
  plot.y_label = "um";
  for (const experiment::TwoMachinesRow& row : result.rows) {
    PlotSeries series;
    series.name = experiment::name(row.mode);
    for (const experiment::CirclePoint& point : row.circle) {
      series.x.push_back(point.angle_rad);
      series.y.push_back(point.error_um);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

namespace {
std::string contour_console(const CycleResult& result) {
  std::string text;
  if (!result.contour.rows.empty()) {
    text += fmt::format("\nA circle of two axes\n\n{}{}\n",
                        contour_table(result.contour.rows).to_text(),
                        contour_method(result.contour.world));
  }
  if (!result.live_contour.empty()) {
    text += fmt::format("\nA circle of two axes, live\n\n{}{}\n",
                        contour_table(result.live_contour).to_text(), kLiveMethod);
  }
  if (!result.two_machines.rows.empty()) {
    text += fmt::format("\nTwo machines, one time\n\n{}{}\n",
                        two_machines_table(result.two_machines).to_text(),
                        two_machines_method(result.two_machines));
  }
  return text;
}
}  // namespace

std::string cycle_console(const CycleResult& result) {
  return contour_console(result) + "\n" +
         fmt::format("{}\n{} seeds\n\n{}\n{}\n\n{}\n{}", kTitle, result.seeds,
                     cycle_table(result).to_text(), kRemark,
                     choices_table(result.choices).to_text(),
                     checks_table(result.checks).to_text());
}

Json cycle_json(const CycleResult& result, const std::string& version) {
  Json rows = Json::array();
  Json support = Json::array();
  for (std::size_t i = 0; i < result.rows.size(); ++i) {
    (result.rows[i].support ? support : rows).push_back(row_json(result, i));
  }
  Json checks = Json::array();
  append_checks(checks, "table6", result.checks);
  Json choices = Json::array();
  append_choices(choices, "table6", result.choices);
  Json traces = Json::array();
  for (const auto& trace : result.traces) {
    traces.push_back(
        {{"row", trace.row}, {"seed", 1}, {"perceived_offset_ns", trace.perceived_ns}});
  }
  return Json{
      {"program", "ftcs"},
      {"version", version},
      {"passed", result.passed()},
      {"tables",
       {{"table6", std::move(rows)}, {"two_machines", two_machines_json(result.two_machines)}}},
      {"checks", std::move(checks)},
      {"choices", std::move(choices)},
      {"support", {{"table6", std::move(support)}}},
      {"figures", {{"figure7", std::move(traces)}}},
      {"contour",
       {{"world", world_json(result.contour)},
        {"rows", contour_json(result.contour.rows)},
        {"live", contour_json(result.live_contour)}}}};
}

std::string cycle_html(const CycleResult& result, const std::string& version) {
  HtmlReport report("Frequency-tracking clock servo: Section V regenerated",
                    "Chen et al., IEEE Access 5 (2017), DOI 10.1109/ACCESS.2017.2715878");
  report.add_table(kTitle, cycle_table(result), fmt::format("{} seeds", result.seeds));
  report.add_note(kRemark);
  report.add_plot(figure_plot(result));
  if (!result.contour.rows.empty()) {
    report.add_table("A circle of two axes", contour_table(result.contour.rows),
                     contour_method(result.contour.world));
    report.add_plot(contour_plot("Contour error of the circle", result.contour.rows));
  }
  if (!result.live_contour.empty()) {
    report.add_table("A circle of two axes, live", contour_table(result.live_contour), kLiveMethod);
    report.add_plot(contour_plot("Contour error of the circle, live", result.live_contour));
  }
  if (!result.two_machines.rows.empty()) {
    report.add_table("Two machines, one time", two_machines_table(result.two_machines),
                     two_machines_method(result.two_machines));
    report.add_plot(two_machines_plot(result.two_machines));
  }
  report.add_table("Choices", choices_table(result.choices));
  report.add_table("Checks", checks_table(result.checks));
  report.add_parameters({{"version", version}});
  return report.render();
}

}  // namespace ftcs
