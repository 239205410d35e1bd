// SPDX-License-Identifier: MIT
#include "ftcs/report/record_report.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "ftcs/record/fields.h"
#include "ftcs/report/number_format.h"

namespace ftcs {
namespace {

constexpr double kNanosecond = 1e-9;
constexpr double kPartPerBillion = 1e-9;
/// Rates of shorter windows would be hidden in their own noise.
constexpr std::size_t kRatesInPlot = 1000;

bool is_frequency(const AnalysedRecord& record) {
  return record.series.kind == RecordKind::kFrequency;
}

std::string span_text(const AnalysedRecord& record) {
  const auto steps = static_cast<double>(std::max<std::size_t>(record.phase.size(), 1) - 1);
  return fmt::format("{:.6g} s", steps * record.series.interval_s);
}

std::string confidence_text(double confidence) {
  return fmt::format("{:.1f} %", 100.0 * confidence);
}

/// Its name in JSON and CSV.
std::string key(Deviation deviation) { return lower_case(name(deviation)); }

/// TDEV and TTOTDEV are times, all others are frequencies.
bool is_time(Deviation deviation) {
  return deviation == Deviation::kTime || deviation == Deviation::kTimeTotal;
}

const StabilityPoint* at_factor(const std::vector<StabilityPoint>& points, std::size_t factor) {
  const auto found = std::find_if(
      points.begin(), points.end(),
      [factor](const StabilityPoint& point) { return point.averaging_factor == factor; });
  return found == points.end() ? nullptr : &*found;
}

Plot values_plot(const AnalysedRecord& record) {
  Plot plot;
  plot.x_label = "time / s";
  if (is_frequency(record)) {
    plot.title = "Frequency deviation over time";
    plot.y_label = "deviation / ppb";
    plot.series = {
        trace_series("frequency", record.series.values, record.series.interval_s, kPartPerBillion)};
    return plot;
  }
  const TimeUnit unit = time_unit_for(record.analysis.summary.absolute_percentile_95);
  const bool offset = record.series.kind == RecordKind::kOffset;
  plot.title = offset ? "Offset over time" : "Phase over time";
  plot.y_label = fmt::format("{} / {}", offset ? "offset" : "phase", unit.name);
  plot.series = {trace_series(offset ? "offset" : "phase", record.phase, record.series.interval_s,
                              unit.seconds)};
  return plot;
}

/// What remains of the phase when the mean frequency is taken off.
std::vector<double> residuals_of(const AnalysedRecord& record) {
  const LineFit& line = record.analysis.line;
  std::vector<double> residuals(record.phase.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    residuals[i] = record.phase[i] - line.intercept -
                   line.slope * record.series.interval_s * static_cast<double>(i);
  }
  return residuals;
}

Plot residual_plot(const AnalysedRecord& record) {
  const TimeUnit unit = time_unit_for(record.analysis.line.residual_rms);
  Plot plot;
  plot.title = "Phase without mean frequency";
  plot.x_label = "time / s";
  plot.y_label = fmt::format("phase / {}", unit.name);
  plot.series = {
      trace_series("residual", residuals_of(record), record.series.interval_s, unit.seconds)};
  plot.note = "A straight line fitted by least squares is taken off.";
  return plot;
}

Plot rate_plot(const AnalysedRecord& record) {
  const std::size_t window = std::max<std::size_t>(record.phase.size() / kRatesInPlot, 1);
  const double tau_s = static_cast<double>(window) * record.series.interval_s;
  const auto rates = mean_rates({record.phase, record.series.interval_s}, window);
  Plot plot;
  plot.title = "Rate over time";
  plot.x_label = "time / s";
  plot.y_label = "rate deviation / ppb";
  plot.series = {trace_series("rate", rates, tau_s, kPartPerBillion)};
  plot.note = fmt::format("Change of the time error over {}, divided by it.", seconds_text(tau_s));
  return plot;
}

/// One start-up transient would squeeze everything else into one bin: what lies beyond the inner 98
/// % by more than their width is only counted.
Histogram histogram_of_bulk(const std::vector<double>& values) {
  const Summary summary = summarize(values);
  const double width = summary.percentile_99 - summary.percentile_1;
  std::vector<double> bulk;
  std::copy_if(
      values.begin(), values.end(), std::back_inserter(bulk), [&summary, width](double value) {
        return value >= summary.percentile_1 - width && value <= summary.percentile_99 + width;
      });
  const Histogram bins = histogram(bulk);
  return histogram(values, bins.lower, bins.upper, bins.counts.size());
}

/// Of the values as recorded; of a phase without its mean frequency, which would be a ramp.
Plot histogram_plot(const AnalysedRecord& record) {
  Plot plot;
  plot.title = "Histogram";
  plot.style = PlotStyle::kFilledSteps;
  plot.y_label = "samples";
  const bool phase = record.series.kind == RecordKind::kPhase;
  const Histogram bins = histogram_of_bulk(phase ? residuals_of(record) : record.series.values);
  double unit = kPartPerBillion;
  plot.x_label = "deviation / ppb";
  if (!is_frequency(record)) {
    const TimeUnit time = time_unit_for(std::max(std::abs(bins.lower), std::abs(bins.upper)));
    unit = time.seconds;
    plot.x_label =
        fmt::format("{} / {}", phase ? "phase without mean frequency" : "offset", time.name);
  }
  plot.series = {histogram_series("samples", bins, unit)};
  if (bins.below + bins.above > 0) {
    plot.note = fmt::format("{} samples lie below, {} above.", bins.below, bins.above);
  }
  return plot;
}

Plot deviation_plot(const AnalysedRecord& record) {
  Plot plot{"Frequency stability",      "tau / s", "deviation", true, true,
            PlotStyle::kLineWithPoints, {},        ""};
  for (const StabilityCurve& curve : record.analysis.curves) {
    if (!is_time(curve.deviation))
      plot.series.push_back(deviation_series(name(curve.deviation), curve.points));
  }
  plot.note = fmt::format("Bands: confidence intervals of {}. NIST SP 1065.",
                          confidence_text(record.confidence));
  return plot;
}

Plot wander_plot(const AnalysedRecord& record) {
  Plot plot{"Time stability",
            "tau / s",
            "TDEV, MTIE / s",
            true,
            true,
            PlotStyle::kLineWithPoints,
            {},
            ""};
  for (const StabilityCurve& curve : record.analysis.curves) {
    if (is_time(curve.deviation))
      plot.series.push_back(deviation_series(name(curve.deviation), curve.points));
  }
  plot.series.push_back(mtie_series("MTIE", record.analysis.wander));
  plot.series.back().lower = plot.series.back().y;
  plot.series.back().upper = plot.series.back().y;
  plot.note = "ITU-T G.810. MTIE is a maximum over this record and has no interval.";
  return plot;
}

/// Below the table.
std::string interval_text(const AnalysedRecord& record) {
  const auto& curves = record.analysis.curves;
  return fmt::format("lower, upper: interval of {} for {} (NIST SP 1065).",
                     confidence_text(record.confidence),
                     curves.empty() ? "nothing" : name(curves.front().deviation));
}

std::vector<LabelledText> parameters(const AnalysedRecord& record) {
  std::vector<LabelledText> list = {{"file", record.file},
                                    {"kind", name(record.series.kind)},
                                    {"interval", seconds_text(record.series.interval_s, 6)},
                                    {"confidence", confidence_text(record.confidence)}};
  for (const std::string& note : record.series.notes) list.emplace_back("reading", note);
  if (record.series.lines_left_out > 0) {
    list.emplace_back("lines without an offset", std::to_string(record.series.lines_left_out));
  }
  return list;
}

}  // namespace

AnalysedRecord analyse_series(std::string file, Series series, const AnalysisOptions& options) {
  AnalysedRecord record;
  record.file = std::move(file);
  record.series = std::move(series);
  record.confidence = options.confidence;
  record.phase = is_frequency(record)
                     ? phase_from_frequency(record.series.values, record.series.interval_s)
                     : record.series.values;
  record.analysis = analyse_record({record.phase, record.series.interval_s}, options);
  if (is_frequency(record)) record.analysis.summary = summarize(record.series.values);
  return record;
}

std::vector<LabelledText> headline_figures(const AnalysedRecord& record) {
  const Summary& summary = record.analysis.summary;
  const auto text = [&record](double value) {
    return is_frequency(record) ? fraction_text(value) : seconds_text(value);
  };
  std::vector<LabelledText> figures = {
      {"samples", fmt::format("{}", record.series.samples)},
      {"missing", fmt::format("{}", record.series.missing)},
      {"span", span_text(record)},
      {"mean", text(summary.moments.mean())},
      {"standard deviation", text(summary.moments.standard_deviation())},
      {"RMS", text(summary.moments.rms())},
      {"95 % of |x|", text(summary.absolute_percentile_95)},
      {is_frequency(record) ? "max |y|" : "max |TE|", text(summary.moments.max_absolute())},
      {"mean frequency", fraction_text(record.analysis.line.slope)},
      {"RMS about the line", seconds_text(record.analysis.line.residual_rms)},
  };
  const auto& curves = record.analysis.curves;
  if (!curves.empty() && !curves.front().points.empty()) {
    const StabilityPoint& first = curves.front().points.front();
    figures.emplace_back(
        fmt::format("{} at {}", name(curves.front().deviation), seconds_text(first.tau_s)),
        significant(first.deviation));
    figures.emplace_back("noise at " + seconds_text(first.tau_s), name(first.noise));
  }
  return figures;
}

Table stability_table(const AnalysedRecord& record) {
  const RecordAnalysis& analysis = record.analysis;
  std::vector<std::string> titles = {"tau / s"};
  for (const StabilityCurve& curve : analysis.curves) {
    titles.push_back(std::string(name(curve.deviation)) + (is_time(curve.deviation) ? " / s" : ""));
    if (&curve == &analysis.curves.front()) titles.insert(titles.end(), {"lower", "upper"});
  }
  titles.insert(titles.end(), {"MTIE / s", "noise"});
  Table table(std::move(titles));
  if (analysis.curves.empty()) return table;
  for (const StabilityPoint& point : analysis.curves.front().points) {
    const std::size_t factor = point.averaging_factor;
    const auto wander =
        std::find_if(analysis.wander.begin(), analysis.wander.end(),
                     [factor](const MtiePoint& other) { return other.averaging_factor == factor; });
    std::vector<Cell> row = {Cell::significant(point.tau_s), Cell::significant(point.deviation),
                             Cell::significant(point.lower), Cell::significant(point.upper)};
    for (std::size_t i = 1; i < analysis.curves.size(); ++i) {
      const StabilityPoint* other = at_factor(analysis.curves[i].points, factor);
      row.push_back(Cell::significant(other == nullptr ? kNoFigure : other->deviation));
    }
    row.push_back(Cell::significant(wander == analysis.wander.end() ? kNoFigure : wander->mtie_s));
    row.emplace_back(name(point.noise));
    table.add_row(std::move(row));
  }
  return table;
}

Table stability_list(const AnalysedRecord& record) {
  Table table({"statistic", "tau_s", "value", "lower", "upper", "terms", "noise"});
  for (const StabilityCurve& curve : record.analysis.curves) {
    for (const StabilityPoint& point : curve.points) {
      table.add_row({key(curve.deviation), Cell::significant(point.tau_s),
                     Cell::significant(point.deviation), Cell::significant(point.lower),
                     Cell::significant(point.upper), Cell::count(point.terms), name(point.noise)});
    }
  }
  for (const MtiePoint& point : record.analysis.wander) {
    table.add_row({"mtie", Cell::significant(point.tau_s), Cell::significant(point.mtie_s), "", "",
                   Cell::count(point.windows), ""});
  }
  return table;
}

std::string console_report(const AnalysedRecord& record) {
  std::string text;
  for (const auto& [label, value] : parameters(record))
    text += fmt::format("{}: {}\n", label, value);
  text += '\n';
  Table figures({"figure", "value"});
  for (const auto& [label, value] : headline_figures(record)) figures.add_row({label, value});
  text += figures.to_text() + '\n' + stability_table(record).to_text();
  return text + '\n' + interval_text(record) + '\n';
}

Json json_report(const AnalysedRecord& record) {
  Json json;
  json["file"] = record.file;
  json["kind"] = name(record.series.kind);
  json["interval_s"] = record.series.interval_s;
  json["samples"] = record.series.samples;
  json["missing"] = record.series.missing;
  json["lines_left_out"] = record.series.lines_left_out;
  json["notes"] = record.series.notes;
  json["confidence"] = record.confidence;
  json["summary"] = is_frequency(record) ? to_json(record.analysis.summary, "ppb", kPartPerBillion)
                                         : to_json(record.analysis.summary, "ns", kNanosecond);
  json["mean_frequency"] = record.analysis.line.slope;
  json["residual_rms_ns"] = record.analysis.line.residual_rms / kNanosecond;
  for (const StabilityCurve& curve : record.analysis.curves)
    json["stability"][key(curve.deviation)] = to_json(curve.points);
  json["mtie"] = to_json(record.analysis.wander);
  return json;
}

std::string html_report(const AnalysedRecord& record) {
  HtmlReport report("Stability of " + record.file,
                    fmt::format("{} record, {} samples over {}", name(record.series.kind),
                                record.series.samples, span_text(record)));
  report.add_figures("Figures", headline_figures(record));
  report.add_plot(values_plot(record));
  if (record.series.kind == RecordKind::kPhase) report.add_plot(residual_plot(record));
  if (!is_frequency(record)) report.add_plot(rate_plot(record));
  report.add_plot(histogram_plot(record));
  report.add_plot(deviation_plot(record));
  report.add_plot(wander_plot(record));
  report.add_table("Stability", stability_table(record), interval_text(record));
  report.add_parameters(parameters(record));
  return report.render();
}

}  // namespace ftcs
