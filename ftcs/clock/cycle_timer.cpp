// SPDX-License-Identifier: MIT
#include "ftcs/clock/cycle_timer.h"

namespace ftcs {

CycleTrigger CycleTimer::next(const SteeringHistory& history) const noexcept {
  const FreeRunningTime exact = history.free_running_at(next_);
  const std::int64_t resolution = config_.resolution.count();
  const std::int64_t shifted =
      (exact.since_epoch() + Duration{config_.resolution}.half()).floor_ns();
  const std::int64_t remainder = shifted % resolution;
  const std::int64_t beyond = remainder < 0 ? remainder + resolution : remainder;
  return {.local = next_,
          .virtual_instant = exact,
          .scheduled = FreeRunningTime::from_ns(shifted - beyond)};
}

std::int64_t CycleTimer::skip_missed(LocalTime now) noexcept {
  const Duration late = now - next_;
  if (late < Duration{}) return 0;
  const std::int64_t missed = late.floor_ns() / config_.cycle_time.count() + 1;
  next_ = next_ + config_.cycle_time * missed;
  return missed;
}

}  // namespace ftcs
