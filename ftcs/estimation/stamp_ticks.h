// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/tick_meter.h"
#include "ftcs/time/per_direction.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::estimation {

/// What two messages of one direction, one after the other, tell of the stamps
/// themselves: the steps of both clocks, and whether one clock has jumped
/// against the other.
class StampTicks {
 public:
  /// A message that is news (MessageOrder). `spread_ns`: what messages are known to be off by,
  /// noise or waits, in the mean.
  void observe(const TimestampPair& message, double spread_ns) noexcept {
    const Stamps to{message.reference.since_epoch().floor_ns(),
                    message.free_running.since_epoch().floor_ns()};
    Side& side = sides_[message.direction];
    jumped_ = side.seen && jump(side.latest, to, kFarLarger * spread_ns);
    if (side.seen) follow_ticks(side.latest, to);
    side = {to, true};
  }
  /// Whether one clock has jumped against the other before the latest message:
  /// their advances since the message before, of the same direction, differ by
  /// more than half, and by more than messages ever wait where they do: a
  /// Pdelay_Resp may come a millisecond after a Sync that has waited for longer.
  [[nodiscard]] bool jumped() const noexcept { return jumped_; }
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
  [[nodiscard]] static bool jump(const Stamps& from, const Stamps& to, double least_ns) noexcept {
    const double reference =
        static_cast<double>(to.reference) - static_cast<double>(from.reference);
    const double free =
        static_cast<double>(to.free_running) - static_cast<double>(from.free_running);
    return std::abs(reference - free) > std::max(0.5 * std::max(reference, free), least_ns);
  }
  void follow_ticks(const Stamps& from, const Stamps& to) noexcept {
    reference_tick_.observe(difference(from.reference, to.reference));
    free_running_tick_.observe(difference(from.free_running, to.free_running));
  }
  [[nodiscard]] static std::uint64_t difference(std::int64_t from, std::int64_t to) noexcept {
    return static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  }

  PerDirection<Side> sides_{};
  TickMeter reference_tick_{}, free_running_tick_{};
  bool jumped_ = false;
};

}  // namespace ftcs::estimation
