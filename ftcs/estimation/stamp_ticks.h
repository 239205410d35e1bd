// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ftcs/estimation/tick_meter.h"
#include "ftcs/time/per_direction.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::estimation {

/// What two messages of one direction, one after the other, tell of the stamps
/// themselves: the steps of both clocks.
class StampTicks {
 public:
  /// A message that is news (MessageOrder).
  void observe(const TimestampPair& message) noexcept {
    const Stamps to{message.reference.since_epoch().floor_ns(),
                    message.free_running.since_epoch().floor_ns()};
    Side& side = sides_[message.direction];
    if (side.seen) follow_ticks(side.latest, to);
    side = {to, true};
  }
  /// Variance that the steps of both clocks' stamps leave open where messages
  /// have noise of so much (rounding included, ns), ns^2.
  [[nodiscard]] double hidden_ns2(double noise_ns) const noexcept {
    const double rounding = reference_tick_.variance_ns2() + free_running_tick_.variance_ns2();
    const double beside = std::max(0.0, noise_ns * noise_ns - rounding);
    return reference_tick_.hidden_ns2(beside) + free_running_tick_.hidden_ns2(beside);
  }
  /// Noise that rounding makes in a message, ns: at least that of whole
  /// nanoseconds.
  [[nodiscard]] double rounding_ns() const noexcept {
    return std::sqrt(reference_tick_.rounding_ns2() + free_running_tick_.rounding_ns2());
  }

 private:
  struct Stamps {
    std::int64_t reference = 0;
    std::int64_t free_running = 0;
  };
  struct Side {
    Stamps latest{};
    bool seen = false;
  };
  void follow_ticks(const Stamps& from, const Stamps& to) noexcept {
    reference_tick_.observe(difference(from.reference, to.reference));
    free_running_tick_.observe(difference(from.free_running, to.free_running));
  }
  [[nodiscard]] static std::uint64_t difference(std::int64_t from, std::int64_t to) noexcept {
    return static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  }

  PerDirection<Side> sides_{};
  TickMeter reference_tick_{}, free_running_tick_{};
};

}  // namespace ftcs::estimation
