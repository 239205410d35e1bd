// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ftcs/time/duration.h"
#include "ftcs/time/rate.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::node {

/// A bound on the path delay, each message with the newest one of the other direction:
///
///     delay = (rate (event_f - event_b) - (reference_f - reference_b)) / 2
///
/// What a delay of one direction hides from the offset is at most the limit less the shortest path:
/// who delays messages, or forges one direction, moves the clock no farther.
class PathLimit {
 public:
  /// Zero: no limit.
  explicit constexpr PathLimit(Nanoseconds largest = Nanoseconds{0}) noexcept : largest_(largest) {}

  /// The delay, where it is beyond the limit; the limit is widened by rate_doubt times the time
  /// between the two messages, which the delay cannot be known better than. `rate`: of the local
  /// clock in units of the oscillator, good to `rate_doubt`. Remembers the pair in any case.
  [[nodiscard]] constexpr std::optional<Duration> excess(const EventPair& pair, Rate rate,
                                                         double rate_doubt) noexcept {
    const bool forward = pair.direction == Direction::kForward;
    (forward ? forward_ : backward_) = pair;
    if (largest_ <= Nanoseconds{0} || !forward_ || !backward_) return std::nullopt;
    const Duration between = forward_->free_running - backward_->free_running;
    const Duration delay =
        (scale(between, rate) - (forward_->reference - backward_->reference)).half();
    const Duration doubt = Duration::from_ns(abs(between).ns() * rate_doubt);
    if (abs(delay) <= Duration{largest_} + doubt) return std::nullopt;
    return delay;
  }
  /// A delay that was measured elsewhere (peer delay).
  [[nodiscard]] constexpr bool exceeds(Duration delay) const noexcept {
    return largest_ > Nanoseconds{0} && abs(delay) > Duration{largest_};
  }
  constexpr void reset() noexcept {
    forward_.reset();
    backward_.reset();
  }

 private:
  Nanoseconds largest_;
  std::optional<EventPair> forward_{};
  std::optional<EventPair> backward_{};
};

}  // namespace ftcs::node
