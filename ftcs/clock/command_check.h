// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <optional>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/clock/affine_map.h"
#include "ftcs/time/servo_command.h"

namespace ftcs {

/// A correction of no or negative length does not take place: the tracking rate holds at once.
[[nodiscard]] constexpr bool has_correction(const ServoCommand& command) noexcept {
  return command.correction_time > Duration{};
}

/// How long the correction lasts on the free-running oscillator: correction_time / tracking_rate.
/// T_c is reference time, and the tracking rate is reference per free running (paper Fig. 3).
[[nodiscard]] inline Duration correction_length(const ServoCommand& command) noexcept {
  const AffineMap<FreeRunningTime, ReferenceTime> reference{{}, {}, command.tracking_rate};
  return reference.inverse(ReferenceTime{command.correction_time}).since_epoch();
}

/// Both rates are numbers, and none of them infinite.
[[nodiscard]] inline bool is_finite(const ServoCommand& command) noexcept {
  return std::isfinite(command.correction_rate.ratio()) &&
         std::isfinite(command.tracking_rate.ratio());
}

/// Why a clock with these limits must refuse the command; no value: it may take it. A correction
/// rate that will not be used may be anything finite.
[[nodiscard]] inline std::optional<ClockError> find_error(const ServoCommand& command,
                                                          const RateLimits& limits) noexcept {
  if (!is_finite(command)) return ClockError::kNotFinite;
  if (!limits.contains(command.tracking_rate)) return ClockError::kRateOutOfLimits;
  if (has_correction(command) && !limits.contains(command.correction_rate)) {
    return ClockError::kRateOutOfLimits;
  }
  return std::nullopt;
}

}  // namespace ftcs
