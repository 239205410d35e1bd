// SPDX-License-Identifier: MIT
#include "ftcs/discipline/cycle_servo.h"

#include "ftcs/discipline/cycle_servo_impl.h"

namespace ftcs {

template class BasicCycleServo<AdaptiveServo>;

}  // namespace ftcs
