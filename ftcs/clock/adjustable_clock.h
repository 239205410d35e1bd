// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/result.h"
#include "ftcs/time/servo_command.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

/// Why a clock did not take a command. Clocks of arithmetic and registers give the last two alone;
/// the others come from an operating system.
enum class ClockError : std::uint8_t {
  kNotPermitted,     ///< the process may not steer this clock
  kBusy,             ///< somebody else holds it
  kGone,             ///< the device disappeared
  kRateOutOfLimits,  ///< the command asks for a rate outside rate_limits()
  kNotFinite,        ///< the command holds a rate that is infinite or not a number
};

/// A clock that can be read and steered: the edge between a servo's command and the world.
///
/// It has two faces. The free-running one, F, is what its oscillator would show had nobody steered
/// it; the local one, L, is what users see. Between two commands dL/dF is a constant rate:
///
///     F_0 <= F < F_0 + T_c / a_t:   L = L_0 + step + a_c (F - F_0)      correction
///     afterwards:                   continuous, at the rate a_t         tracking
///
/// with a_c = correction_rate, a_t = tracking_rate, T_c = correction_time (in reference time, which
/// is local time at the rate a_t) and step of the ServoCommand applied at F_0. A command replaces
/// its predecessor, even in the middle of a correction, whose rest is dropped; nothing accumulates.
/// A clock that takes a command guarantees its expiry: after correction_time it runs at
/// tracking_rate even if nobody calls again (a virtual clock exactly, others by a timer).
///
///     const auto applied = clock.apply({.tracking_rate = Rate::from_ppb(120.0)});   // faster
///     if (!applied) return tell(applied.error());
///     const LocalTime shown = clock.local_at(stamp);  // stamp: of the free-running oscillator
///
/// Implementations: VirtualClock, AddendClock, RegisterClock; platform::KernelClock. One thread
/// owns a clock. Virtual because a system call dwarfs the dispatch and the set of clocks is open.
class AdjustableClock {
 public:
  /// Both faces of the clock at one instant. Not const: a clock of hardware ends a correction here
  /// that is due.
  [[nodiscard]] virtual ClockReading read() noexcept = 0;
  /// What the steered clock showed (or, for an instant to come, would show) when the free-running
  /// oscillator showed `instant`. Stamps arrive late (Follow_Up, transmit stamps), so that they may
  /// lie before the last few commands: exact within the steering history, extrapolated from its
  /// oldest segment before it.
  [[nodiscard]] virtual LocalTime local_at(FreeRunningTime instant) const noexcept = 0;
  /// Permitted rates, local per free running; valid(), and the same for as long as the clock lives:
  /// a discipline asks once.
  [[nodiscard]] virtual RateLimits rate_limits() const noexcept = 0;
  /// Applies the command now: first the step, then the correction rate. Returns the reading at
  /// which it took effect, after the step. On an error nothing has changed: kNotFinite before
  /// kRateOutOfLimits, both before anything is asked of the world. A correction rate is judged
  /// only if correction_time is above zero, but must be finite all the same.
  [[nodiscard]] virtual Result<ClockReading, ClockError> apply(
      const ServoCommand& command) noexcept = 0;
  /// The most by which corrections have lately ended late; not below zero. A clock that ends them
  /// in its own arithmetic or hardware is never late, one that a process has to end is as late as
  /// that process is woken.
  [[nodiscard]] virtual Duration expiry_lateness() const noexcept { return {}; }

 protected:
  AdjustableClock() = default;
  AdjustableClock(const AdjustableClock&) = default;
  AdjustableClock& operator=(const AdjustableClock&) = default;
  // Not virtual: nobody deletes through the base, and operator delete needs a heap.
  ~AdjustableClock() = default;
};

/// An injected free-running oscillator (CLOCK_MONOTONIC_RAW on a PC, simulated time in the
/// laboratory). Nobody may steer it: what is taken for its rate is learnt over minutes.
class FreeRunningSource {
 public:
  /// The oscillator's reading; must not run backward. The epoch does not matter.
  [[nodiscard]] virtual FreeRunningTime now() noexcept = 0;

 protected:
  FreeRunningSource() = default;
  FreeRunningSource(const FreeRunningSource&) = default;
  FreeRunningSource& operator=(const FreeRunningSource&) = default;
  // Not virtual: nobody deletes through the base, and operator delete needs a heap.
  ~FreeRunningSource() = default;
};

}  // namespace ftcs
