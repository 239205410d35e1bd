// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "ftcs/clock/command_check.h"

namespace ftcs {

/// The same correction over a longer time, where the clock ends corrections late.
///
/// A correction of the offset e over T_c that ends late by L leaves
///
///     e - (1 + L / T_c) e = -(L / T_c) e
///
/// From message to message that decays below L = T_c and grows above. So T_c becomes
///
///     T_c' = min(max(T_c, 4 L), 8 T_c),        a_c' = a_t + (a_c - a_t) T_c / T_c'
///
/// (a_c, a_t: correction and tracking rate), which removes the same offset: a quarter of it at most
/// is left, unless that is more than eight T_c. Eight T_c of the adaptive servo are its interval:
/// by then another command has come. A rate or a time that the actuator does not have is rounded by
/// it; what that leaves is the next command's.
///
/// `lateness`: AdjustableClock::expiry_lateness(). A command without a correction is left as it is.
[[nodiscard]] inline ServoCommand stretched(ServoCommand command, Duration lateness) noexcept {
  constexpr double kLatenesses = 4.0;
  constexpr double kMostTimes = 8.0;
  if (!has_correction(command)) return command;
  const double planned = command.correction_time.ns();
  const double longer = std::min(kLatenesses * lateness.ns(), kMostTimes * planned);
  if (longer <= planned) return command;
  const double tracking = command.tracking_rate.ratio();
  const double pull = (command.correction_rate.ratio() - tracking) * (planned / longer);
  command.correction_rate = Rate::from_ratio(tracking + pull);
  command.correction_time = Duration::from_ns(longer);
  return command;
}

}  // namespace ftcs
