// SPDX-License-Identifier: MIT
#include "ftcs/report/trace_plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "ftcs/analysis/mtie.h"
#include "ftcs/analysis/stability.h"
#include "ftcs/report/table.h"

namespace ftcs {
namespace {

using experiment::RunTrace;

/// The start that is drawn: enough to see the slowest servo of the field settle.
constexpr double kStartCycles = 60.0;
/// Bins of a decade of |time error|.
constexpr double kBinsPerDecade = 12.0;
/// Below it a time error says nothing: picoseconds of a simulated clock.
constexpr double kLeastErrorNs = 1e-3;
constexpr double kNanosecondsPerSecond = 1e9;

Plot plot_of(const char* title, const char* x, const char* y) {
  Plot plot;
  plot.title = title;
  plot.x_label = x;
  plot.y_label = y;
  return plot;
}

std::span<const double> measured(const RunTrace& trace, const std::vector<double>& values) {
  return std::span(values).subspan(std::min(trace.first_measured, values.size()));
}

/// `values` over time from the beginning of the window on.
PlotSeries window_series(const RunTrace& trace, const std::vector<double>& values) {
  const auto x = measured(trace, trace.time_s);
  const auto y = measured(trace, values);
  return {trace.servo, {x.begin(), x.end()}, {y.begin(), y.end()}, {}, {}};
}

PlotSeries start_series(const RunTrace& trace) {
  PlotSeries series;
  series.name = trace.servo;
  for (std::size_t i = 0; i < trace.time_s.size(); ++i) {
    const double cycle = trace.time_s[i] / trace.interval_s;
    if (cycle > kStartCycles) break;
    series.x.push_back(cycle);
    series.y.push_back(std::max(std::abs(trace.time_error_ns[i]), kLeastErrorNs));
  }
  return series;
}

/// The share of samples in each twelfth of a decade of |time error|.
PlotSeries distribution_series(const RunTrace& trace) {
  const auto errors = measured(trace, trace.time_error_ns);
  std::vector<int> bins;
  for (const double error : errors) {
    const double size = std::max(std::abs(error), kLeastErrorNs);
    bins.push_back(static_cast<int>(std::floor(std::log10(size) * kBinsPerDecade)));
  }
  PlotSeries series;
  series.name = trace.servo;
  if (bins.empty()) return series;
  const auto [least, most] = std::minmax_element(bins.begin(), bins.end());
  const auto share = [&](int bin) {
    return 100.0 * static_cast<double>(std::count(bins.begin(), bins.end(), bin)) /
           static_cast<double>(bins.size());
  };
  for (int bin = *least - 1; bin <= *most + 1; ++bin) {
    series.x.push_back(std::pow(10.0, (bin + 0.5) / kBinsPerDecade));
    series.y.push_back(share(bin));
  }
  return series;
}

/// Equal spacing, without which TDEV and MTIE have no tau.
bool on_a_grid(std::span<const double> times) {
  if (times.size() < 8) return false;
  const double step = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (std::abs(times[i] - times[i - 1] - step) > 1e-3 * step) return false;
  }
  return true;
}

void add_wander(const RunTrace& trace, Plot& time_deviation, Plot& wander) {
  const auto times = measured(trace, trace.time_s);
  if (!on_a_grid(times)) return;
  std::vector<double> phase;
  for (const double error : measured(trace, trace.time_error_ns))
    phase.push_back(error / kNanosecondsPerSecond);
  const PhaseRecord record{phase, times[1] - times[0]};
  const auto factors = octave_factors(phase.size());
  time_deviation.series.push_back(
      deviation_series(trace.servo, stability(Deviation::kTime, record, factors)));
  wander.series.push_back(mtie_series(trace.servo, mtie(record, factors)));
}

}  // namespace

std::vector<Plot> trace_plots(const std::vector<RunTrace>& traces) {
  if (traces.empty()) return {};
  Plot start = plot_of("The start: true time error, first seed", "cycle", "|time error| / ns");
  start.log_y = true;
  Plot error = plot_of("True time error over the measurement window, first seed", "time / s",
                       "local minus reference / ns");
  Plot rate = plot_of("Rate error between corrections", "time / s", "rate error / ppb");
  Plot distribution =
      plot_of("Histogram of the true time error", "|time error| / ns", "% of samples");
  distribution.log_x = true;
  distribution.style = PlotStyle::kLineWithPoints;
  distribution.note = "Twelve bins a decade.";
  Plot deviation = plot_of("TDEV of the true time error", "tau / s", "TDEV / s");
  Plot wander = plot_of("MTIE of the true time error", "tau / s", "MTIE / s");
  for (Plot* plot : {&deviation, &wander}) {
    plot->log_x = plot->log_y = true;
    plot->style = PlotStyle::kLineWithPoints;
  }
  for (const RunTrace& trace : traces) {
    start.series.push_back(start_series(trace));
    error.series.push_back(window_series(trace, trace.time_error_ns));
    rate.series.push_back(window_series(trace, trace.rate_error_ppb));
    distribution.series.push_back(distribution_series(trace));
    add_wander(trace, deviation, wander);
  }
  std::vector<Plot> plots = {start, error, rate, distribution};
  if (!deviation.series.empty()) {
    plots.push_back(deviation);
    plots.push_back(wander);
  }
  return plots;
}

std::string trace_csv(const std::vector<RunTrace>& traces) {
  std::string text = "servo,time_s,time_error_ns,rate_error_ppb\n";
  for (const RunTrace& trace : traces) {
    const std::string servo = csv_field(trace.servo);
    for (std::size_t i = 0; i < trace.time_s.size(); ++i) {
      text += servo + ',' + csv_number(trace.time_s[i]) + ',' + csv_number(trace.time_error_ns[i]) +
              ',' + csv_number(trace.rate_error_ppb[i]) + '\n';
    }
  }
  return text;
}

}  // namespace ftcs
