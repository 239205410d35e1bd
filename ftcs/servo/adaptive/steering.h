// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/time/servo_command.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

/// What the clock can do and what its users bear. Valid: rate.valid(), all others finite and not
/// below zero; validate(AdaptiveConfig) says kRateLimits or kActuator, nothing here asks.
struct SteeringLimits {
  RateLimits rate = RateLimits::symmetric_ppb(3e7);  ///< paper's F, local per free running
  /// Largest change of the rate in one command, dimensionless (drives that follow the clock cannot
  /// take more). Zero: any.
  double rate_change = 0.0;
  /// Rates that the actuator can set differ by this (one LSB of an addend). Zero: continuous.
  double rate_granularity = 0.0;
  /// Correction times the actuator can keep are multiples of this (a timer's tick). Zero: any.
  Nanoseconds time_granularity{0};
  /// From the reading handed to the servo to the moment at which its command takes effect.
  Nanoseconds latency{0};
  /// False: only rates are commanded, and time never jumps. True: the first command steps when the
  /// rate limit cannot remove the offset within one correction time.
  bool first_step_allowed = false;
};

namespace adaptive {

/// What steering needs to know about the clocks at the reading: offset = local - reference (ns,
/// filtered), and the ratio free running per reference.
struct SteeringState {
  double offset_ns = 0.0;
  double free_per_reference = 1.0;
};

/// The command, and whether it steps.
struct Steered {
  ServoCommand command{};
  bool stepped = false;
};

/// Deadbeat steering on the filtered estimate (paper eq. 17 with p = 1): with r = free running per
/// reference, local advances (1 - offset / T_c) / r per free running for T_c, then 1 / r. Where a
/// limit binds, T_c is stretched so that the offset is still removed exactly at its end; to a day
/// at most, by which time other messages have come.
///
/// The limits are applied in this order: change of rate against the last tracking rate,
/// granularity, F. Remembers its last command, for the change of rate and for what the clock does
/// during the latency.
class Steering {
 public:
  Steering() noexcept = default;
  explicit Steering(const SteeringLimits& limits) noexcept : limits_(limits) {}

  /// `correction_time_ns`: T_c of reference time, above zero; state.free_per_reference above zero.
  [[nodiscard]] Steered steer(const SteeringState& state, double correction_time_ns) noexcept;
  /// The next command is the first one: it may step, and change the rate by any amount.
  void reset() noexcept { commanded_ = false; }
  [[nodiscard]] const SteeringLimits& limits() const noexcept { return limits_; }

 private:
  [[nodiscard]] double offset_at_effect(const SteeringState& state) const noexcept;
  [[nodiscard]] double quantised(double rate) const noexcept;
  [[nodiscard]] Rate bounded(double rate) const noexcept;

  SteeringLimits limits_{};
  ServoCommand last_{};
  bool commanded_ = false;
};

}  // namespace adaptive
}  // namespace ftcs
