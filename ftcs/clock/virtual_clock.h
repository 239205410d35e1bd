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
  /// Of apply(), local per free running; narrowed to what AffineMap can hold, 1/1024 to 1023. An
  /// initial rate outside is pulled to the nearer end; one that is not a number becomes 1.
  RateLimits limits{};
};

/// A clock that exists in arithmetic alone: a piecewise affine function of a free-running
/// oscillator, paper eq. (3) and (8):
///
///     L(F) = L_i + a_i (F - F_i),   F_i <= F < F_i+1,   a_i = local per free running
///
/// A correction ends at F_apply + correction_time / tracking_rate whether or not anybody calls.
/// Exact: no rounding error accumulates, however often it is steered (2^-32 ns of resolution, what
/// is cut off is carried on). Valid commands: finite rates within rate_limits() (the correction
/// rate only if correction_time > 0), correction_time below 2^62 ns. Any other is refused, but for
/// the last, which nobody checks.
///
///     VirtualClock clock(oscillator, {.free_running = oscillator.now(), .local = start});
///     clock.apply(command);                  // kRateOutOfLimits or kNotFinite, or done
///     const LocalTime shown = clock.read().local;
///
/// Remembers the last sixteen segments, two for a command with a correction and one without: that
/// is how far back local_at() is exact. A call costs a search through those and a multiplication of
/// 128 bits.
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
  /// known better than the moment of the call. What was planned for later is dropped. Instants must
  /// not run backward from call to call; otherwise an earlier command is overwritten from there on.
  [[nodiscard]] Result<ClockReading, ClockError> apply_at(FreeRunningTime instant,
                                                          const ServoCommand& command) noexcept;
  /// The segments themselves: what a CycleTimer needs to place its triggers.
  [[nodiscard]] const SteeringHistory& history() const noexcept { return history_; }

 private:
  FreeRunningSource& source_;
  RateLimits limits_;
  SteeringHistory history_;
};

}  // namespace ftcs
