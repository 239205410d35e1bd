// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "ftcs/sim/random.h"

namespace ftcs::sim {

// What makes an oscillator deviate. Each part gives the mean fractional frequency deviation y over
// one cell of the oscillator's grid; an oscillator's frequency is the sum of its parts (as
// clknetsim composes its noise sources).

/// y = skew, for ever.
struct ConstantSkew {
  double deviation = 0.0;
};
/// y(t) = drift * t.
struct Ageing {
  double deviation_per_second = 0.0;
};
/// y(t) = deviation from `at` on.
struct FrequencyStep {
  double at_seconds = 0.0;
  double deviation = 0.0;
};
/// y(t) = amplitude sin(2 pi (t/period + phase)); a random phase if `random_phase`. Temperature
/// cycles.
struct FrequencySine {
  double amplitude = 0.0;
  double period_seconds = 1.0;
  double phase_cycles = 0.0;
  bool random_phase = false;
};
/// y(t) = ±amplitude, changing its sign every `half_period_seconds`.
struct FrequencySquare {
  double amplitude = 0.0;
  double half_period_seconds = 1.0;
  bool random_phase = false;
};
/// Temperature ramp: y rises linearly from 0 at `from` to `deviation` at `to` and stays.
struct FrequencyRamp {
  double from_seconds = 0.0;
  double to_seconds = 1.0;
  double deviation = 0.0;
};
/// White FM: independent cells, standard deviation adev_1s / sqrt(cell). adev_1s is the Allan
/// deviation at 1 s.
struct WhiteFm {
  double adev_1s = 0.0;
};
/// Flicker FM: Allan deviation `floor` at all averaging times (NIST SP 1065, 4.3: sigma_y = sqrt(2
/// ln 2 h_-1)). A sum of first-order processes whose time constants are spaced by a factor of four.
struct FlickerFm {
  double floor = 0.0;
};
/// Random-walk FM: y makes a step of standard deviation step_1s * sqrt(cell) from cell to cell.
struct RandomWalkFm {
  double step_1s = 0.0;
};
/// A recorded frequency: y[i] over [i, i+1) * interval; the last value stays.
struct ReplayedFrequency {
  double interval_seconds = 1.0;
  std::shared_ptr<const std::vector<double>> deviations;
};

using FrequencyPart =
    std::variant<ConstantSkew, Ageing, FrequencyStep, FrequencySine, FrequencySquare, FrequencyRamp,
                 WhiteFm, FlickerFm, RandomWalkFm, ReplayedFrequency>;

/// A recorded phase x[i] (seconds) as frequency: y[i] = (x[i+1] - x[i]) / interval.
[[nodiscard]] ReplayedFrequency replay_phase(const std::vector<double>& phase_seconds,
                                             double interval_seconds);

/// The running sum of the parts, cell after cell.
class FrequencySource {
 public:
  FrequencySource(std::vector<FrequencyPart> parts, std::uint64_t seed, std::uint64_t index);
  ~FrequencySource();
  FrequencySource(FrequencySource&&) noexcept;
  FrequencySource& operator=(FrequencySource&&) noexcept;

  /// Mean deviation over [start, start + length). Cells must be asked for in order.
  [[nodiscard]] double next(double start_seconds, double length_seconds);

 private:
  struct Generator;
  std::vector<Generator> generators_;
};

}  // namespace ftcs::sim
