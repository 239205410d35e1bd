// SPDX-License-Identifier: MIT
#include "ftcs/clock/virtual_clock.h"

#include "ftcs/clock/command_check.h"

namespace ftcs {

VirtualClock::VirtualClock(FreeRunningSource& source, const VirtualClockConfig& config) noexcept
    : source_(source),
      limits_(intersect(config.limits, FixedRate::kLimits)),
      history_(
          SteeringHistory::Map{config.free_running, config.local, limits_.clamp(config.rate)}) {}

ClockReading VirtualClock::read() noexcept {
  const FreeRunningTime now = source_.now();
  return {now, local_at(now)};
}

LocalTime VirtualClock::local_at(FreeRunningTime instant) const noexcept {
  return history_.local_at(instant);
}

Result<ClockReading, ClockError> VirtualClock::apply(const ServoCommand& command) noexcept {
  return apply_at(source_.now(), command);
}

Result<ClockReading, ClockError> VirtualClock::apply_at(FreeRunningTime instant,
                                                        const ServoCommand& command) noexcept {
  if (const auto error = find_error(command, limits_)) return *error;
  const bool corrects = has_correction(command);
  const Rate first = corrects ? command.correction_rate : command.tracking_rate;
  const LocalTime local = history_.steer(instant, first, command.step);
  if (corrects) history_.steer(instant + correction_length(command), command.tracking_rate);
  return ClockReading{instant, local};
}

}  // namespace ftcs
