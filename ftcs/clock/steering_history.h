// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>

#include "ftcs/clock/affine_map.h"
#include "ftcs/clock/segment_ring.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs {

/// What a steered clock showed, or will show: the last affine segments between free-running and
/// local time.
///
/// Follow_Up, Delay_Resp and transmit stamps arrive after the next command may have been given;
/// each stamp is converted by the segment in which it was taken. A step is a boundary between two
/// segments and nothing else. A value of fixed size; a call searches at most kCapacity segments.
class SteeringHistory {
 public:
  using Map = AffineMap<FreeRunningTime, LocalTime>;
  /// Eight commands of two segments (correction, tracking).
  static constexpr std::size_t kCapacity = 16;

  explicit SteeringHistory(const Map& first) noexcept : segments_(Segment{first}) {}

  /// From `instant` on the clock runs at `rate`, after a jump by `step`. What was planned for later
  /// is dropped. Returns what the clock shows at `instant`, after the jump.
  LocalTime steer(FreeRunningTime instant, Rate rate, Duration step = {}) noexcept {
    const Segment next{segments_.at(instant).map.continued(instant, rate).stepped(step)};
    segments_.append(next);
    return next.map.to_base();
  }

  /// What was measured says that the segment now in force lies elsewhere (a kernel's clock is known
  /// from readings, not from commands): moves that segment alone.
  void shift_newest(Duration by) noexcept {
    Segment& newest = segments_.newest();
    newest.map = newest.map.stepped(by);
  }

  /// Exact within the history; before it, the oldest segment is extended backward.
  [[nodiscard]] LocalTime local_at(FreeRunningTime instant) const noexcept {
    return segments_.at(instant).map(instant);
  }
  /// Local per free running, in force from `instant` on.
  [[nodiscard]] Rate rate_at(FreeRunningTime instant) const noexcept {
    return segments_.at(instant).map.rate();
  }
  /// When the clock showed `local`. Of two instants (it stepped back) the later one; what it never
  /// showed (it stepped over it) belongs to the step.
  [[nodiscard]] FreeRunningTime free_running_at(LocalTime local) const noexcept {
    std::size_t age = 0;
    while (age + 1 < segments_.size() && local - segments_.newest(age).map.to_base() < Duration{})
      ++age;
    const FreeRunningTime instant = segments_.newest(age).map.inverse(local);
    if (age == 0) return instant;
    const FreeRunningTime end = segments_.newest(age - 1).start();
    return end - instant < Duration{} ? end : instant;
  }

 private:
  struct Segment {
    Map map;
    [[nodiscard]] FreeRunningTime start() const noexcept { return map.from_base(); }
  };

  SegmentRing<Segment, kCapacity> segments_;
};

}  // namespace ftcs
