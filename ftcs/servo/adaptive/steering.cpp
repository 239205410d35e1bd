// SPDX-License-Identifier: MIT
#include "ftcs/servo/adaptive/steering.h"

#include <algorithm>
#include <cmath>

namespace ftcs::adaptive {
namespace {

/// A day: a correction that would take longer is held until the next message replaces it.
constexpr double kLongestCorrectionNs = 86'400e9;

}  // namespace

/// What the last command does between the reading and the moment of effect. If its correction has
/// ended meanwhile the difference is below latency times the correction, second order.
double Steering::offset_at_effect(const SteeringState& state) const noexcept {
  if (!commanded_ || limits_.latency == Nanoseconds{0}) return state.offset_ns;
  const double latency = static_cast<double>(limits_.latency.count());
  return state.offset_ns + latency * (last_.tracking_rate.ratio() - 1.0 / state.free_per_reference);
}

double Steering::quantised(double rate) const noexcept {
  if (limits_.rate_granularity <= 0.0) return rate;
  return 1.0 + std::round((rate - 1.0) / limits_.rate_granularity) * limits_.rate_granularity;
}

Rate Steering::bounded(double rate) const noexcept {
  double wanted = rate;
  if (commanded_ && limits_.rate_change > 0.0) {
    const double from = last_.tracking_rate.ratio();
    wanted = std::clamp(wanted, from - limits_.rate_change, from + limits_.rate_change);
  }
  return limits_.rate.clamp(Rate::from_ratio(quantised(wanted)));
}

Steered Steering::steer(const SteeringState& state, double correction_time_ns) noexcept {
  const double r = state.free_per_reference;
  Steered result;
  double offset = offset_at_effect(state);
  ServoCommand& command = result.command;
  command.tracking_rate = bounded(1.0 / r);
  Rate correction = bounded((1.0 - offset / correction_time_ns) / r);
  const double wanted = -offset / correction_time_ns;
  const double possible = correction.ratio() * r - 1.0;
  const bool binds = std::abs(possible) < 0.999 * std::abs(wanted);
  if (binds && !commanded_ && limits_.first_step_allowed) {
    command.step = Duration::from_ns(-offset);
    result.stepped = true;
    offset = 0.0;
    correction = command.tracking_rate;
  }
  double time = correction_time_ns;
  const double pull = correction.ratio() * r - 1.0;
  // A pull of the wrong sign, or none, comes from quantisation or from limits on the wrong side of
  // the tracking rate: hold it for T_c, as the best that can be done.
  if (offset * pull < 0.0) time = std::min(-offset / pull, kLongestCorrectionNs);
  if (limits_.time_granularity > Nanoseconds{0}) {
    const double tick = static_cast<double>(limits_.time_granularity.count());
    time = std::max(1.0, std::round(time / tick)) * tick;
    correction = bounded((1.0 - offset / time) / r);
  }
  command.correction_rate = correction;
  command.correction_time = Duration::from_ns(time);
  last_ = command;
  commanded_ = true;
  return result;
}

}  // namespace ftcs::adaptive
