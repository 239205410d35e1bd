// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/discipline/basic_clock_discipline.h"
#include "ftcs/servo/any_servo.h"

namespace ftcs {

/// The rules, and the servo with all that can be set about it.
struct DisciplineConfig : DisciplineRules {
  ServoConfig servo{};  ///< its limits are narrowed by the clock's own
};

extern template class BasicClockDiscipline<AnyServo>;

/// BasicClockDiscipline of the servo that the configuration names.
class ClockDiscipline : public BasicClockDiscipline<AnyServo> {
 public:
  /// The clock must outlive the discipline. Valid: validate(config.servo) finds nothing; it is not
  /// asked here. Beside largest_rate_change the adaptive servo plans with half of it, so that the
  /// end of a correction keeps to it too.
  ClockDiscipline(const DisciplineConfig& config, AdjustableClock& clock) noexcept;
};

}  // namespace ftcs
