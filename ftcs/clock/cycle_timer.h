// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/clock/steering_history.h"
#include "ftcs/time/instant.h"

namespace ftcs {

/// The grid of triggers, on the steered clock, and that of the timer, on the unsteered one.
struct CycleTimerConfig {
  LocalTime first;           ///< local time of the first trigger
  Nanoseconds cycle_time{};  ///< nominal length of a cycle, on the steered clock; above 0
  Nanoseconds resolution{
      1};  ///< the timer can only fire at multiples of it on the unsteered clock; above 0

  [[nodiscard]] constexpr bool valid() const noexcept {
    return cycle_time > Nanoseconds{0} && resolution > Nanoseconds{0};
  }
};

/// One trigger, on both clocks: |scheduled - virtual_instant| <= resolution / 2.
struct CycleTrigger {
  LocalTime local;  ///< the cycle's nominal time on the steered clock
  FreeRunningTime
      virtual_instant;        ///< when the unsteered clock shows that: where the trigger should be
  FreeRunningTime scheduled;  ///< nearest multiple of the resolution (halves upward): where it is

  /// Known to whoever sets the timer, hence no noise: a measured phase error can be freed from it
  /// before a servo sees it.
  [[nodiscard]] Duration rounding() const noexcept { return scheduled - virtual_instant; }
};

/// Steers by moving the next trigger, for a system whose clock cannot be touched (paper II-B and V:
/// RTX, 10 us).
///
/// The steered clock is the count of cycles. A rate a, local per free running, makes the cycle T_m
/// = cycle_time / a long on the unsteered clock (eq. 25 and 26 act on T_m); T_m is a real number,
/// only the trigger is rounded and its rounding never enters the next one. The history belongs to a
/// VirtualClock that takes the servo's commands.
///
///     for (;;) { sleep_until(timer.next(clock.history()).scheduled);  work();  timer.advance(); }
///
/// BasicCycleServo is this with a servo around it.
class CycleTimer {
 public:
  /// Valid: config.valid(); it is not asked here.
  explicit CycleTimer(const CycleTimerConfig& config) noexcept
      : config_(config), next_(config.first) {}

  /// The next trigger under the latest command. Ask again after each command: the trigger moves.
  [[nodiscard]] CycleTrigger next(const SteeringHistory& history) const noexcept;
  /// The trigger fired: on to the next one.
  void advance() noexcept { next_ = next_ + config_.cycle_time; }
  /// Moves to the first trigger after `now` and returns how many were passed over; zero if the next
  /// one is still to come. Never moves back.
  std::int64_t skip_missed(LocalTime now) noexcept;

 private:
  CycleTimerConfig config_;
  LocalTime next_;
};

}  // namespace ftcs
