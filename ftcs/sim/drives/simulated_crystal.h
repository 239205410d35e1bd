// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <utility>

#include "ftcs/sim/drives/oscillator.h"
#include "ftcs/sim/oscillator.h"
#include "ftcs/time/relabel.h"

namespace ftcs::sim {

/// A crystal of the simulator on the time of the wire, which `start` is the true time 0 of.
class SimulatedCrystal final : public ethercat::LocalOscillator {
 public:
  SimulatedCrystal(OscillatorSpec spec, std::uint64_t seed, std::uint64_t index,
                   ethercat::WireTime start)
      : oscillator_(std::move(spec), seed, index), start_(start) {}
  [[nodiscard]] Duration reading(ethercat::WireTime instant) noexcept override {
    return oscillator_.reading_at(TrueTime{instant - start_}).since_epoch() +
           extra_.reading(instant);
  }
  /// An additional deviation from an instant on.
  void skew(double ppm, ethercat::WireTime from) noexcept {
    extra_.set_rate(Rate::from_ratio(ppm * 1e-6), from);
  }

 private:
  Oscillator oscillator_;
  ethercat::WireTime start_;
  ethercat::AffineOscillator extra_{Rate::from_ratio(0.0)};
};

}  // namespace ftcs::sim
