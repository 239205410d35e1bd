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
