// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/sim/oscillator.h"
#include "ftcs/sim/quantiser.h"
#include "ftcs/sim/settable_source.h"
#include "ftcs/sim/two_way.h"

namespace ftcs::sim {

/// The reference: true time, with its jumps.
class ReferenceClock {
 public:
  ReferenceClock(std::vector<ReferenceStep> steps, Duration tick)
      : steps_(std::move(steps)), quantise_(tick) {}

  [[nodiscard]] ReferenceTime at(TrueTime t) const noexcept {
    Duration reading = t.since_epoch();
    for (const ReferenceStep& step : steps_) {
      if (t.since_epoch() >= step.at) reading += step.size;
    }
    return ReferenceTime{reading};
  }
  [[nodiscard]] ReferenceTime stamp(TrueTime t) const noexcept { return quantise_(at(t)); }

 private:
  std::vector<ReferenceStep> steps_;
  Quantiser quantise_;
};

/// One steered clock of the chain: oscillator, virtual clock, and the links to its upstream. Who
/// steers it is for others.
class Node {
 public:
  Node(const NodeSpec& spec, std::uint64_t seed, std::uint64_t index)
      : oscillator(spec.oscillator, seed, index),
        forward(spec.forward, seed, 2 * index),
        backward(spec.backward, seed, 2 * index + 1),
        clock(source, {oscillator.reading_at(TrueTime{}), LocalTime{spec.initial_offset}, Rate{},
                       spec.limits}),
        quantise_(spec.tick),
        stamp_noise_(seed, "stamp noise", index),
        stamp_noise_ns_(spec.stamp_noise_ns) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Free-running timestamp of an event now.
  [[nodiscard]] FreeRunningTime stamp(TrueTime t) {
    FreeRunningTime reading = oscillator.reading_at(t);
    if (stamp_noise_ns_ > 0.0)
      reading = reading + Duration::from_ns(stamp_noise_ns_ * stamp_noise_.normal());
    return quantise_(reading);
  }
  [[nodiscard]] LocalTime local_at(TrueTime t) { return clock.local_at(oscillator.reading_at(t)); }
  /// From now on the clock is read and steered at t.
  void set_time(TrueTime t) { source.set(oscillator.reading_at(t)); }

  Oscillator oscillator;
  Link forward;
  Link backward;
  SettableSource source;
  VirtualClock clock;

 private:
  Quantiser quantise_;
  RandomStream stamp_noise_;
  double stamp_noise_ns_;
};

}  // namespace ftcs::sim
