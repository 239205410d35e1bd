// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "ftcs/analysis/line_fit.h"
#include "ftcs/analysis/mtie.h"
#include "ftcs/analysis/stability.h"
#include "ftcs/analysis/statistics.h"

namespace ftcs {

/// Mean rates (x_(i+m) - x_i)/(m tau_0), fractional, for i = 0, m, 2m, ...; a missing point gives a
/// missing rate.
[[nodiscard]] std::vector<double> mean_rates(PhaseRecord record, std::size_t averaging_factor);

/// What to compute of a record.
struct AnalysisOptions {
  double confidence = kOneSigmaConfidence;  ///< of the intervals, within (0, 1)
  std::vector<Deviation> deviations = {Deviation::kOverlappingAllan, Deviation::kModifiedAllan,
                                       Deviation::kOverlappingHadamard, Deviation::kTime};
  /// Of the points' number: octave_factors, decade_factors, all_factors.
  std::vector<std::size_t> (*factors)(std::size_t points) = octave_factors;
  /// Instead of them, if there are any: averaging times in seconds, taken to the nearest multiple
  /// of the interval.
  std::vector<double> taus_s;
};

/// One statistic over tau.
struct StabilityCurve {
  Deviation deviation = Deviation::kOverlappingAllan;
  std::vector<StabilityPoint> points;
};

/// Every figure of one phase record.
struct RecordAnalysis {
  Summary summary;  ///< of the time errors
  LineFit line;     ///< slope: mean frequency offset; residual: time error without it
  std::vector<StabilityCurve> curves;  ///< in the order that was asked for
  std::vector<MtiePoint> wander;       ///< MTIE

  /// The points of one statistic; none if it was not asked for.
  [[nodiscard]] std::span<const StabilityPoint> points(Deviation deviation) const noexcept;
};

[[nodiscard]] RecordAnalysis analyse_record(PhaseRecord record,
                                            const AnalysisOptions& options = {});

}  // namespace ftcs
