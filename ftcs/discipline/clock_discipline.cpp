// SPDX-License-Identifier: MIT
#include "ftcs/discipline/clock_discipline.h"

#include <algorithm>
#include <cmath>

namespace ftcs {
namespace {

/// A command of the adaptive servo keeps both of its rates this near to the last tracking rate, and
/// rounds them: with half of what may change, the end of a correction keeps to the limit too.
double planned_rate_change(const SteeringLimits& steering, double largest) noexcept {
  const double room = largest - steering.rate_granularity;
  const double planned = (room > 0.0 ? room : largest) / 2.0;
  return steering.rate_change > 0.0 ? std::min(steering.rate_change, planned) : planned;
}

ServoConfig limited(const DisciplineConfig& config, const RateLimits& limits) noexcept {
  ServoConfig servo = config.servo;
  servo.limits = limits;
  if (config.largest_rate_change > 0.0) {
    SteeringLimits& steering = servo.adaptive.steering;
    steering.rate_change = planned_rate_change(steering, config.largest_rate_change);
  }
  return servo;
}

bool has_fixed_delay(const ServoConfig& servo) noexcept {
  return servo.two_way.fixed_path_delay ||
         (servo.kind == ServoKind::kAdaptive && servo.adaptive.fixed_path_delay) ||
         (servo.kind == ServoKind::kKalman && servo.kalman.fixed_path_delay) ||
         (servo.kind == ServoKind::kMinimumDelay && servo.minimum_delay.fixed_path_delay);
}

ServoTraits traits_of(const ServoConfig& servo) noexcept {
  const bool plans = servo.kind == ServoKind::kAdaptive;
  return {servo.limits,
          plans ? servo.adaptive.steering.rate : servo.limits,
          servo.sync_interval,
          has_fixed_delay(servo),
          servo.kind == ServoKind::kLinuxptpPi,
          servo.kind != ServoKind::kFreeRunning};
}

}  // namespace

template class BasicClockDiscipline<AnyServo>;

ClockDiscipline::ClockDiscipline(const DisciplineConfig& config, AdjustableClock& clock) noexcept
    : BasicClockDiscipline(config, traits_of(config.servo), clock, [&](const RateLimits& limits) {
        return make_servo(limited(config, limits));
      }) {}

}  // namespace ftcs
