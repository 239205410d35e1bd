// SPDX-License-Identifier: MIT
#include "ftcs/analysis/record_analysis.h"

#include <algorithm>
#include <cmath>

namespace ftcs {

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

RecordAnalysis analyse_record(PhaseRecord record, double confidence) {
  RecordAnalysis analysis;
  analysis.summary = summarize(record.seconds);
  analysis.line = fit_line(record.seconds, record.interval_s);
  const auto factors = octave_factors(record.seconds.size());
  analysis.overlapping_allan = stability(Deviation::kOverlappingAllan, record, factors, confidence);
  analysis.modified_allan = stability(Deviation::kModifiedAllan, record, factors, confidence);
  analysis.overlapping_hadamard =
      stability(Deviation::kOverlappingHadamard, record, factors, confidence);
  analysis.time = stability(Deviation::kTime, record, factors, confidence);
  analysis.wander = mtie(record, factors, confidence);
  return analysis;
}

}  // namespace ftcs
