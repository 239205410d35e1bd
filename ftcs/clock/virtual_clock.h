// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/clock/steering_history.h"

namespace ftcs {

/// How a virtual clock starts: at `free_running` it shows `local` and runs at `rate`.
struct VirtualClockConfig {
  FreeRunningTime free_running{};
  LocalTime local{};
  Rate rate{};
  RateLimits limits{};  ///< of apply(); narrowed to what AffineMap can hold
};

/// A clock that exists in arithmetic alone: an affine function of a free-running oscillator, paper
/// eq. (3) and (8).
///
/// A correction ends at F_apply + correction_time / tracking_rate whether or not anybody calls.
/// Exact: no rounding error accumulates, however often it is steered. Valid commands: finite rates
/// within rate_limits() (the correction rate only if correction_time > 0), correction_time below
/// 2^62 ns.
class VirtualClock final : public AdjustableClock {
 public:
  /// The source must outlive the clock.
  VirtualClock(FreeRunningSource& source, const VirtualClockConfig& config) noexcept;

  [[nodiscard]] ClockReading read() noexcept override;
  [[nodiscard]] LocalTime local_at(FreeRunningTime instant) const noexcept override;
  [[nodiscard]] RateLimits rate_limits() const noexcept override { return limits_; }
  [[nodiscard]] Result<ClockReading, ClockError> apply(
      const ServoCommand& command) noexcept override;

  /// As apply(), but from a given instant on: for a simulation, or where the moment of action is
  /// known better than the moment of the call.
  [[nodiscard]] Result<ClockReading, ClockError> apply_at(FreeRunningTime instant,
                                                          const ServoCommand& command) noexcept;
  [[nodiscard]] const SteeringHistory& history() const noexcept { return history_; }

 private:
  FreeRunningSource& source_;
  RateLimits limits_;
  SteeringHistory history_;
};

}  // namespace ftcs
