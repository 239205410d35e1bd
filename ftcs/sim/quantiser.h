// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "ftcs/time/duration.h"
#include "ftcs/time/instant.h"

namespace ftcs::sim {

/// Granularity of a timestamp: the nearest whole multiple of `tick`, halves upwards, so that the
/// error has mean zero (a counter that cuts off is half a tick of constant offset more, which
/// belongs to the path delay). tick zero: exact. A tick of whole nanoseconds is exact at any
/// instant; a fraction is counted from the epoch in double precision (2^-53 of it).
class Quantiser {
 public:
  explicit Quantiser(Duration tick = {}) noexcept : tick_(tick) {}

  template <class Timescale>
  [[nodiscard]] Instant<Timescale> operator()(Instant<Timescale> instant) const noexcept {
    if (tick_ <= Duration{}) return instant;
    if (tick_.fraction() != 0) {
      const double ticks = std::floor(instant.since_epoch().ns() / tick_.ns() + 0.5);
      return Instant<Timescale>{Duration::from_ns(ticks * tick_.ns())};
    }
    const std::int64_t tick = tick_.floor_ns();
    const std::int64_t raised = (instant.since_epoch() + tick_.half()).floor_ns();
    if (tick == 1) return Instant<Timescale>::from_ns(raised);  // the usual one, without a division
    const std::int64_t remainder = raised % tick;
    return Instant<Timescale>::from_ns(raised - (remainder < 0 ? remainder + tick : remainder));
  }

 private:
  Duration tick_;
};

}  // namespace ftcs::sim
