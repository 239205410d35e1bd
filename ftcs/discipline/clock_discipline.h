// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/discipline/basic_clock_discipline.h"
#include "ftcs/servo/any_servo.h"

namespace ftcs {

struct DisciplineConfig : DisciplineRules {
  ServoConfig servo{};  ///< its limits are narrowed by the clock's own
};

extern template class BasicClockDiscipline<AnyServo>;

/// BasicClockDiscipline of the servo that the configuration names.
class ClockDiscipline : public BasicClockDiscipline<AnyServo> {
 public:
  /// The clock must outlive the discipline. Valid: validate(config.servo) finds nothing.
  ClockDiscipline(const DisciplineConfig& config, AdjustableClock& clock) noexcept;
};

}  // namespace ftcs
