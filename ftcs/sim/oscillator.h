// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "ftcs/sim/frequency_source.h"
#include "ftcs/sim/true_time.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs::sim {

struct OscillatorSpec {
  FreeRunningTime initial{};  ///< what it shows at true time 0
  Duration grid =
      Nanoseconds{1'000'000'000};  ///< its frequency is constant within a cell of this length; > 0
  std::vector<FrequencyPart> parts;  ///< summed; none = perfect
};

/// A free-running oscillator: F(t), continuous, its frequency constant on the cells of a grid.
///
///   F(t) = F(t_i) + (t - t_i) (1 + y_i),   t_i <= t < t_{i+1}
///
/// Both directions are exact: true_at(reading_at(t)) differs from t by at most the resolution,
/// 2^-32 ns, over the rate. The last kMemory cells are kept, so that memory does not grow with the
/// run; an instant before them is extrapolated from the oldest.
class Oscillator {
 public:
  Oscillator(OscillatorSpec spec, std::uint64_t seed, std::uint64_t index = 0);

  [[nodiscard]] FreeRunningTime reading_at(TrueTime t);
  [[nodiscard]] TrueTime true_at(FreeRunningTime reading);
  /// What it shows and 1 + y at that instant.
  struct State {
    FreeRunningTime reading;
    Rate rate;
  };
  [[nodiscard]] State state_at(TrueTime t) {
    const Segment& segment = segment_at(t);
    return {segment.at(t), segment.rate};
  }

 private:
  static constexpr std::size_t kMemory = 1024;
  struct Segment {
    TrueTime start;
    FreeRunningTime reading;
    Rate rate;

    [[nodiscard]] FreeRunningTime at(TrueTime t) const noexcept {
      return reading + scale(t - start, rate);
    }
  };

  [[nodiscard]] const Segment& segment_at(TrueTime t);
  void extend();
  [[nodiscard]] const Segment& recall(std::uint64_t cell) const noexcept {
    return segments_[cell % kMemory];
  }
  [[nodiscard]] std::uint64_t oldest() const noexcept {
    return cells_ > kMemory ? cells_ - kMemory : 0;
  }

  FrequencySource source_;
  Duration grid_;
  std::vector<Segment> segments_;
  std::uint64_t cells_ = 0;  ///< cells made so far
  TrueTime end_;             ///< end of the newest cell
  FreeRunningTime end_reading_;
};

}  // namespace ftcs::sim
