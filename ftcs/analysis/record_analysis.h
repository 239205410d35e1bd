// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "ftcs/analysis/mtie.h"
#include "ftcs/analysis/stability.h"
#include "ftcs/analysis/statistics.h"

namespace ftcs {

/// The straight line through equally spaced values by least squares; missing values are left out.
struct LineFit {
  double intercept = kNoFigure;  ///< at the first place
  double slope = kNoFigure;      ///< per second
  double residual_rms = kNoFigure;
};

/// interval_s > 0. Fewer than two values: no figures.
[[nodiscard]] LineFit fit_line(std::span<const double> values, double interval_s);

/// Mean rates (x_(i+m) - x_i)/(m tau_0), fractional, for i = 0, m, 2m, ...; a missing point gives a
/// missing rate.
[[nodiscard]] std::vector<double> mean_rates(PhaseRecord record, std::size_t averaging_factor);

/// Every figure of one phase record, at octaves of tau.
struct RecordAnalysis {
  Summary summary;  ///< of the time errors
  LineFit line;     ///< slope: mean frequency offset; residual: time error without it
  std::vector<StabilityPoint> overlapping_allan;
  std::vector<StabilityPoint> modified_allan;
  std::vector<StabilityPoint> overlapping_hadamard;
  std::vector<StabilityPoint> time;
  std::vector<MtiePoint> wander;  ///< MTIE
};

/// confidence: of the intervals of the deviations, 0 < confidence < 1.
[[nodiscard]] RecordAnalysis analyse_record(PhaseRecord record,
                                            double confidence = kOneSigmaConfidence);

}  // namespace ftcs
