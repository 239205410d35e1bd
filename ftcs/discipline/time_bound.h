// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ftcs/discipline/telemetry.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs {

/// How wide an interval is stated.
struct BoundRules {
  /// Standard deviations on either side. Six leave room for the tails that a servo's own sigma does
  /// not know: a normal one would leave 2e-9 outside.
  double sigmas = 6.0;
  /// As long as a servo has heard little, it knows less than it says of what the path does:
  /// sigmas (1 + early / samples).
  double early = 16.0;
  /// What the oscillator's rate may drift by while nobody looks, dimensionless: a quartz in a room.
  double wander = 1e-7;
  /// What no estimate knows: the asymmetry of the path, latencies of stamps.
  Nanoseconds unknown{0};
};

/// Where the time of the reference surely is, as a function of the oscillator:
///
///     time(f) = time + rate (f - at)      half width(f) = bound_ns + growth |f - at|
///     bound = sigmas sigma_offset + unknown,  growth = sigmas sigma_rate + wander
///
/// True time lies within time_at(f) ± half_width_ns(f), if the path has no asymmetry beyond
/// `unknown`. Between messages it widens by itself; nobody has to be asked.
struct TimeBound {
  enum class State : std::uint8_t { kUnknown, kUnlocked, kLocked, kHoldover };
  State state = State::kUnknown;
  FreeRunningTime at{};
  ReferenceTime time{};
  Rate rate;
  double bound_ns = 0.0;
  double growth = 0.0;

  /// The best guess, and how far it may be wrong, ns, on either side. At `at` or later; before it
  /// the width grows as well.
  [[nodiscard]] ReferenceTime time_at(FreeRunningTime instant) const noexcept {
    return time + scale(instant - at, rate);
  }
  [[nodiscard]] double half_width_ns(FreeRunningTime instant) const noexcept {
    return bound_ns + growth * std::abs((instant - at).ns());
  }
};

/// From what ClockDiscipline::on_silence() or on_pair() told. Unknown, where the servo does not
/// know its own deviation (the adaptive servo and the Kalman filter do), or no path delay is known.
/// `samples`: ClockDiscipline::samples().
[[nodiscard]] inline TimeBound time_bound(const Telemetry& telemetry, std::uint32_t samples,
                                          const BoundRules& rules = {}) noexcept {
  TimeBound bound;
  const ServoSnapshot& servo = telemetry.servo;
  const bool honest = servo.offset_known && std::isfinite(servo.offset_sigma_ns) &&
                      std::isfinite(servo.rate_sigma_ppb);
  if (!honest) return bound;
  const bool holdover = servo.state == ServoState::kHoldover;
  bound.state = telemetry.locked ? TimeBound::State::kLocked
                : holdover       ? TimeBound::State::kHoldover
                                 : TimeBound::State::kUnlocked;
  bound.at = telemetry.reading.free_running;
  bound.time = ReferenceTime{(telemetry.reading.local - servo.offset).since_epoch()};
  bound.rate = servo.rate_ratio;
  const double sigmas = rules.sigmas * (1.0 + rules.early / std::max(samples, 1U));
  bound.bound_ns = sigmas * servo.offset_sigma_ns + static_cast<double>(rules.unknown.count());
  bound.growth = sigmas * servo.rate_sigma_ppb * 1e-9 + rules.wander;
  return bound;
}

}  // namespace ftcs
