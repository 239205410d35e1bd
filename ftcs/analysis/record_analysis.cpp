// SPDX-License-Identifier: MIT
#include "ftcs/analysis/record_analysis.h"

#include <algorithm>
#include <cmath>

namespace ftcs {
namespace {

/// Ascending, each once.
std::vector<std::size_t> factors_of(PhaseRecord record, const AnalysisOptions& options) {
  if (options.taus_s.empty()) return options.factors(record.seconds.size());
  std::vector<std::size_t> factors;
  for (const double tau_s : options.taus_s) {
    const double factor = std::round(tau_s / record.interval_s);
    if (factor >= 1.0 && factor < static_cast<double>(record.seconds.size()))
      factors.push_back(static_cast<std::size_t>(factor));
  }
  std::sort(factors.begin(), factors.end());
  factors.erase(std::unique(factors.begin(), factors.end()), factors.end());
  return factors;
}

}  // namespace

LineFit fit_line(std::span<const double> values, double interval_s) {
  RunningStatistics places;
  RunningStatistics heights;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    places.add(static_cast<double>(i));
    heights.add(values[i]);
  }
  LineFit fit;
  if (places.count() < 2) return fit;
  double squares = 0.0;
  double products = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    const double distance = static_cast<double>(i) - places.mean();
    squares += distance * distance;
    products += distance * (values[i] - heights.mean());
  }
  const double per_place = products / squares;
  fit.slope = per_place / interval_s;
  fit.intercept = heights.mean() - per_place * places.mean();
  RunningStatistics residuals;
  for (std::size_t i = 0; i < values.size(); ++i) {
    residuals.add(values[i] - fit.intercept - per_place * static_cast<double>(i));
  }
  fit.residual_rms = residuals.rms();
  return fit;
}

std::vector<double> mean_rates(PhaseRecord record, std::size_t averaging_factor) {
  const std::size_t m = std::max<std::size_t>(averaging_factor, 1);
  const double tau_s = static_cast<double>(m) * record.interval_s;
  std::vector<double> rates;
  for (std::size_t i = 0; i + m < record.seconds.size(); i += m) {
    rates.push_back((record.seconds[i + m] - record.seconds[i]) / tau_s);
  }
  return rates;
}

std::span<const StabilityPoint> RecordAnalysis::points(Deviation deviation) const noexcept {
  for (const StabilityCurve& curve : curves) {
    if (curve.deviation == deviation) return curve.points;
  }
  return {};
}

RecordAnalysis analyse_record(PhaseRecord record, const AnalysisOptions& options) {
  RecordAnalysis analysis;
  analysis.summary = summarize(record.seconds);
  analysis.line = fit_line(record.seconds, record.interval_s);
  const auto factors = factors_of(record, options);
  for (const Deviation deviation : options.deviations) {
    analysis.curves.push_back(
        {deviation, stability(deviation, record, factors, options.confidence)});
  }
  analysis.wander = mtie(record, factors, options.confidence);
  return analysis;
}

}  // namespace ftcs
