// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "ftcs/fieldbus/demo_report.h"
#include "ftcs/fieldbus/run_html.h"
#include "ftcs/report/cycle_report.h"
#include "ftcs/report/html_report.h"

namespace ftcs::daemon {

namespace {

Plot offset_plot_of(const DemoResult& result) {
  Plot plot;
  plot.title = "PTP: how far off the clock was at each Sync message";
  plot.x_label = "Sync message";
  plot.y_label = "|true offset| / ns";
  plot.log_y = true;  // the first millisecond and the last nanoseconds in one picture
  constexpr double kLeastNs = 1.0;
  for (const experiment::TrialResult& servo : result.servos) {
    std::vector<double> sizes;
    for (const double offset : servo.true_offsets_ns) {
      sizes.push_back(std::max(std::abs(offset), kLeastNs));
    }
    plot.series.push_back(trace_series(servo.servo, sizes, 1.0, 1.0));
  }
  plot.note = fmt::format("The lock band is ±{}.", format_time(result.lock_band_ns));
  return plot;
}

std::string lock_text(const DemoResult& result) {
  const experiment::TrialResult& first = result.servos.front();
  if (!first.cycles_to_lock) return "not locked";
  return fmt::format("{} control interval{}", *first.cycles_to_lock,
                     *first.cycles_to_lock == 1 ? "" : "s");
}

}  // namespace

std::string demo_html(const DemoOptions& options, const DemoResult* result,
                      const EthercatDemo* ethercat) {
  HtmlReport report("Frequency-tracking clock servo: demonstration",
                    "A clock locked over PTP, and the cycle of eight EtherCAT drives");
  std::vector<LabelledText> figures;
  if (result != nullptr) {
    figures.emplace_back(fmt::format("PTP, {}: locked after", result->servos.front().servo),
                         lock_text(*result));
  }
  if (ethercat != nullptr && !ethercat->runs.empty()) {
    const MainRunner& run = *ethercat->runs.front();
    const double intervals = static_cast<double>(run.figures().lock_cycle) /
                             static_cast<double>(run.options().servo.cycles_per_sync);
    figures.emplace_back(fmt::format("EtherCAT, {}: locked after", run.options().servo_name),
                         run.figures().lock_cycle < 0
                             ? "not locked"
                             : fmt::format("{:.1f} sync intervals", intervals));
  }
  report.add_figures("In short", figures);
  if (result != nullptr) {
    report.add_table("PTP: all servos on the same packets", demo_table(*result),
                     demo_method(options, *result));
    report.add_plot(offset_plot_of(*result));
  }
  if (ethercat != nullptr) {
    add_run_sections(report, ethercat->views());
    report.add_table("EtherCAT: what the drives saw in the last run",
                     drives_table(ethercat->segment->server()));
    if (!ethercat->machines.rows.empty()) {
      report.add_table("Two machines, one time (simulated)", two_machines_table(ethercat->machines),
                       two_machines_method(ethercat->machines));
      report.add_plot(two_machines_plot(ethercat->machines));
    }
  }
  report.add_parameters({{"version", FTCS_VERSION},
                         {"duration of the PTP part", fmt::format("{:g} s", options.duration_s)},
                         {"traffic", "loopback, this machine"}});
  return report.render();
}

}  // namespace ftcs::daemon
