// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/run_html.h"

#include <cstdlib>

#include <fmt/format.h>

#include "ftcs/fieldbus/run_histograms.h"
#include "ftcs/fieldbus/run_report.h"

namespace ftcs::daemon {

namespace {

PlotSeries over_time(const MainRunner& run, float experiment::CyclePoint::*field) {
  PlotSeries series;
  series.name = run.options().servo_name;
  for (const experiment::CyclePoint& point : run.figures().trace) {
    series.x.push_back(static_cast<double>(point.time_s));
    series.y.push_back(static_cast<double>(point.*field));
  }
  return series;
}

Plot time_plot(std::span<const MainRunner* const> runs, const char* title, const char* label,
               float experiment::CyclePoint::*field) {
  Plot plot;
  plot.title = title;
  plot.x_label = "s";
  plot.y_label = label;
  for (const MainRunner* run : runs) plot.series.push_back(over_time(*run, field));
  return plot;
}

Plot histogram_plot(const MainRunner& run, const char* title,
                    float experiment::CyclePoint::*field) {
  Plot plot;
  plot.title = fmt::format("{}, {}", title, run.options().servo_name);
  plot.x_label = "us";
  plot.y_label = "cycles";
  plot.style = PlotStyle::kFilledSteps;
  const Histogram bins = run_histogram(run.figures(), field);
  if (bins.counts.empty()) return plot;
  plot.series.push_back(histogram_series("cycles", bins, 1.0));
  plot.note = fmt::format("{} cycles lie outside.", bins.below + bins.above);
  return plot;
}

/// What happened on the way, of all runs: locks, drives that left OP and came back.
Table events_table(std::span<const MainRunner* const> runs) {
  Table table({"servo", "s", "drive", "what", "AL status code"});
  for (const MainRunner* run : runs) {
    for (const experiment::CycleEvent& event : run->figures().events) {
      const bool coded = event.note.code != ethercat::AlStatusCode::kNoError;
      table.add_row(
          {run->options().servo_name, Cell::fixed(event.time_s, 3),
           event.note.drive == node::CycleNote::kNobody ? Cell{"-"} : Cell::count(event.note.drive),
           name(event.note.kind),
           coded ? fmt::format("0x{:04X} {}", static_cast<unsigned>(event.note.code),
                               ethercat::name(event.note.code))
                 : "-"});
    }
  }
  return table;
}

std::string relock_text(std::span<const MainRunner* const> runs) {
  std::string text;
  for (const MainRunner* run : runs) {
    const experiment::CycleFigures& figures = run->figures();
    text += fmt::format("{}: lock lost {} times, longest way back {} cycles. ",
                        run->options().servo_name, figures.lock.losses(),
                        figures.lock.longest_relock());
  }
  return text;
}

std::string pair_of(const QuantileSketch& sketch) {
  if (sketch.count() == 0) return "-";
  return format_time(sketch.absolute_quantile(0.5)) + " / " +
         format_time(sketch.absolute_quantile(0.99));
}

}  // namespace

Table runs_table(std::span<const MainRunner* const> runs) {
  Table table({"servo", "locked", "cycles to lock", "sync intervals", "virtual phase p50 / p99",
               "frame itself p50 / p99", "working counter right", "lost", "stalls", "excluded",
               "|0x092C|"});
  for (const MainRunner* run : runs) {
    const experiment::CycleFigures& figures = run->figures();
    const bool locked = figures.lock_cycle >= 0;
    const double intervals = static_cast<double>(figures.lock_cycle) /
                             static_cast<double>(run->options().servo.cycles_per_sync);
    const std::uint64_t all = figures.judged + figures.excluded;
    const double excluded =
        all == 0 ? 0.0 : static_cast<double>(figures.excluded) / static_cast<double>(all);
    const bool every_cycle = run->options().servo.law == CycleLaw::kAdaptive ||
                             run->options().servo.cycles_per_sync == 1;
    table.add_row(
        {run->options().servo_name, run->decision().state == CycleState::kLocked ? "yes" : "no",
         locked ? Cell::count(static_cast<unsigned long long>(figures.lock_cycle)) : Cell{"-"},
         locked && !every_cycle ? Cell::fixed(intervals, 1) : Cell{"-"},
         pair_of(locked ? figures.phase : figures.second_half_phase),
         pair_of(locked ? figures.wire_phase : figures.second_half_wire_phase),
         fmt::format("{} of {}", figures.working_counter_right, figures.cycles),
         Cell::count(run->main().counters().lost), Cell::count(figures.host_stalls),
         fmt::format("{:.2f} %", 100.0 * excluded),
         figures.worst_difference_ns ? fmt::format("< {} ns", *figures.worst_difference_ns + 1)
                                     : "-"});
  }
  return table;
}

void add_run_sections(HtmlReport& report, std::span<const MainRunner* const> runs) {
  report.add_table(
      "EtherCAT: the cycle and its reference", runs_table(runs),
      "Virtual phase: the cycle as scheduled against SYNC0's grid, the sender's lateness (which it "
      "knows) taken off. Frame itself: lateness included. From the lock on (never locked: the "
      "second "
      "half). Cycles later or slower than the gate are "
      "left out; their share is \"excluded\". |0x092C| from one second after the lock.");
  report.add_plot(time_plot(runs, "Phase error of the cycle, early is positive", "us",
                            &experiment::CyclePoint::phase_us));
  if (runs.empty()) return;
  report.add_table("EtherCAT: what happened", events_table(runs), relock_text(runs));
  const MainRunner& first = *runs.front();
  report.add_plot(
      histogram_plot(first, "Margin from the frame to SYNC0", &experiment::CyclePoint::margin_us));
  report.add_plot(
      histogram_plot(first, "Lateness of the wake-up", &experiment::CyclePoint::lateness_us));
  report.add_plot(
      histogram_plot(first, "Phase error of the cycle", &experiment::CyclePoint::phase_us));
  report.add_plot(
      histogram_plot(first, "Round trip of the frame", &experiment::CyclePoint::round_trip_us));
}

Table drives_table(const SegmentServer& server) {
  Table table({"drive", "state", "AL status", "|0x092C| / ns", "SYNC0 events", "missed",
               "smallest margin / us", "largest margin / us"});
  const ethercat::Segment& segment = server.segment();
  for (std::size_t n = 0; n < segment.size(); ++n) {
    const ethercat::SubDevice& device = segment[n];
    const ethercat::SyncStatistics& sync = device.drive().statistics();
    const bool judged = sync.events > sync.missed;
    constexpr double kMicro = 1e-3;
    table.add_row(
        {Cell::count(n), ethercat::name(device.drive().state()),
         ethercat::name(device.drive().code()),
         Cell::count(static_cast<unsigned long long>(std::abs(device.system_time_difference()))),
         Cell::count(sync.events), Cell::count(sync.missed),
         judged ? Cell::fixed(static_cast<double>(sync.smallest_margin_ns) * kMicro, 1) : Cell{"-"},
         judged ? Cell::fixed(static_cast<double>(sync.largest_margin_ns) * kMicro, 1)
                : Cell{"-"}});
  }
  return table;
}

}  // namespace ftcs::daemon
