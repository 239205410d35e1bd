// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/clock/command_check.h"

namespace ftcs {

/// Keeps the rate of a clock from changing by more than so much at a time: by a command, by the end
/// of its correction, or by a command that comes before that end. Drives that follow the clock, or
/// an oscillator, bear no more.
///
///     |a_c - a| <= largest,   |a_t - a_c| <= largest
///
/// a_c, a_t: correction and tracking rate of the command; a: any rate that may be in force when it
/// takes effect. What is cut off an offset's correction is left for the next command.
class RateChangeLimit {
 public:
  /// `largest`: dimensionless; zero: any.
  explicit RateChangeLimit(double largest) noexcept : largest_(largest) {}

  /// Before the first command: the clock runs at the rate that it is found at.
  void begin(const AdjustableClock& clock, FreeRunningTime now) noexcept {
    if (begun_ || largest_ <= 0.0) return;
    begun_ = true;
    constexpr double kWindowNs = 1e9;  // a rate shows in what the clock would show a second later
    const Duration window = Duration::from_ns(kWindowNs);
    const Duration passed = clock.local_at(now + window) - clock.local_at(now);
    tracking_ = correction_ = 1.0 + (passed - window).ns() / kWindowNs;
  }

  /// The command that comes nearest to `command`. A rate that is not a number is left as it is.
  [[nodiscard]] ServoCommand limited(ServoCommand command, FreeRunningTime now) const noexcept {
    if (largest_ <= 0.0) return command;
    // The correction may be over by the time at which the command takes effect, or not yet.
    const double other = now < end_ ? correction_ : tracking_;
    const double lowest = std::max(tracking_, other) - largest_;
    const double highest = std::min(tracking_, other) + largest_;
    const auto within = [](Rate rate, double from, double to) {
      return Rate::from_ratio(std::clamp(rate.ratio(), from, to));
    };
    if (!has_correction(command)) {
      command.tracking_rate = within(command.tracking_rate, lowest, highest);
      return command;
    }
    command.correction_rate = within(command.correction_rate, lowest, highest);
    const double first = command.correction_rate.ratio();
    command.tracking_rate = within(command.tracking_rate, first - largest_, first + largest_);
    return command;
  }

  /// The clock has taken the command.
  void note(const ServoCommand& command, FreeRunningTime now) noexcept {
    tracking_ = command.tracking_rate.ratio();
    correction_ = has_correction(command) ? command.correction_rate.ratio() : tracking_;
    end_ = has_correction(command) ? now + correction_length(command) : now;
  }

  /// What the clock runs at now, by the last command noted.
  [[nodiscard]] Rate in_force(FreeRunningTime now) const noexcept {
    return Rate::from_ratio(now < end_ ? correction_ : tracking_);
  }

 private:
  double largest_;
  bool begun_ = false;
  double tracking_ = 1.0;
  double correction_ = 1.0;
  FreeRunningTime end_{};  ///< of the correction
};

}  // namespace ftcs
