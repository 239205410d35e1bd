// SPDX-License-Identifier: MIT
#include "ftcs/sim/oscillator.h"

#include <utility>

namespace ftcs::sim {

Oscillator::Oscillator(OscillatorSpec spec, std::uint64_t seed, std::uint64_t index)
    : source_(std::move(spec.parts), seed, index),
      grid_(spec.grid),
      segments_(kMemory),
      end_reading_(spec.initial) {
  extend();
}

void Oscillator::extend() {
  const double deviation = source_.next(end_.since_epoch().seconds(), grid_.seconds());
  const Segment segment{end_, end_reading_, Rate::from_ratio(1.0 + deviation)};
  segments_[cells_ % kMemory] = segment;
  ++cells_;
  end_ = end_ + grid_;
  end_reading_ = segment.at(end_);
}

const Oscillator::Segment& Oscillator::segment_at(TrueTime t) {
  while (t >= end_) extend();
  std::uint64_t cell = cells_ - 1;
  while (cell > oldest() && recall(cell).start > t) --cell;
  return recall(cell);
}

FreeRunningTime Oscillator::reading_at(TrueTime t) { return state_at(t).reading; }

TrueTime Oscillator::true_at(FreeRunningTime reading) {
  while (reading >= end_reading_) extend();
  std::uint64_t cell = cells_ - 1;
  while (cell > oldest() && recall(cell).reading > reading) --cell;
  const Segment& segment = recall(cell);
  const TrueTime guess = segment.start + scale(reading - segment.reading, segment.rate.inverse());
  // One correction removes what rounding 1/(1 + y) left.
  return guess + (reading - segment.at(guess));
}

}  // namespace ftcs::sim
