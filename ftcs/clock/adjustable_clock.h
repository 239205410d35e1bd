// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/result.h"
#include "ftcs/time/servo_command.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

enum class ClockError : std::uint8_t {
  kNotPermitted,     ///< the process may not steer this clock
  kBusy,             ///< somebody else holds it
  kGone,             ///< the device disappeared
  kRateOutOfLimits,  ///< the command asks for a rate outside rate_limits()
  kNotFinite,        ///< the command holds a rate that is not a number
};

/// A clock that can be read and steered: the edge between a servo's command and the world.
///
/// Virtual because a system call dwarfs the dispatch and the set of clocks is open. Commands
/// replace, never accumulate. A clock that takes a command guarantees its expiry: after
/// correction_time it runs at tracking_rate even if nobody calls again (a virtual clock exactly,
/// others by a timer).
class AdjustableClock {
 public:
  /// Both faces of the clock at one instant.
  [[nodiscard]] virtual ClockReading read() noexcept = 0;
  /// What the steered clock showed (or, for an instant to come, would show) when the free-running
  /// oscillator showed `instant`. Stamps arrive late (Follow_Up, transmit stamps), so that they may
  /// lie before the last few commands: exact within the steering history, extrapolated from its
  /// oldest segment before it.
  [[nodiscard]] virtual LocalTime local_at(FreeRunningTime instant) const noexcept = 0;
  /// Permitted rates, local per free running.
  [[nodiscard]] virtual RateLimits rate_limits() const noexcept = 0;
  /// Applies the command now. Returns the reading at which it took effect. On an error nothing has
  /// changed.
  [[nodiscard]] virtual Result<ClockReading, ClockError> apply(
      const ServoCommand& command) noexcept = 0;

 protected:
  AdjustableClock() = default;
  AdjustableClock(const AdjustableClock&) = default;
  AdjustableClock& operator=(const AdjustableClock&) = default;
  // Not virtual: nobody deletes through the base, and operator delete needs a heap.
  ~AdjustableClock() = default;
};

/// An injected free-running oscillator (CLOCK_MONOTONIC_RAW on a PC, simulated time in the
/// laboratory).
class FreeRunningSource {
 public:
  [[nodiscard]] virtual FreeRunningTime now() noexcept = 0;

 protected:
  FreeRunningSource() = default;
  FreeRunningSource(const FreeRunningSource&) = default;
  FreeRunningSource& operator=(const FreeRunningSource&) = default;
  // Not virtual: nobody deletes through the base, and operator delete needs a heap.
  ~FreeRunningSource() = default;
};

}  // namespace ftcs
