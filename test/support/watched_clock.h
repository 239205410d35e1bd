// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "ftcs/clock/command_check.h"
#include "ftcs/clock/virtual_clock.h"

namespace ftcs::test {

/// A virtual clock that can be told to refuse commands, or to end corrections late, and that notes
/// what it was told and the largest change of its rate: by a command, or by the end of a
/// correction.
class WatchedClock final : public AdjustableClock {
 public:
  explicit WatchedClock(FreeRunningSource& source, Duration offset, RateLimits limits = {})
      : source_(source),
        clock_(source,
               {source.now(), LocalTime{source.now().since_epoch() + offset}, Rate{}, limits}) {}

  [[nodiscard]] ClockReading read() noexcept override { return clock_.read(); }
  [[nodiscard]] LocalTime local_at(FreeRunningTime instant) const noexcept override {
    return clock_.local_at(instant);
  }
  [[nodiscard]] RateLimits rate_limits() const noexcept override { return clock_.rate_limits(); }
  [[nodiscard]] Result<ClockReading, ClockError> apply(
      const ServoCommand& command) noexcept override {
    if (refuse) return ClockError::kBusy;
    const double before = rate();
    const double after = command.tracking_rate.ratio();
    const double first = has_correction(command) ? command.correction_rate.ratio() : after;
    largest_change = std::max({largest_change, std::abs(first - before), std::abs(after - first)});
    last = command;
    ServoCommand late = command;
    if (has_correction(command)) late.correction_time += ends_late_by;
    return clock_.apply(late);
  }
  [[nodiscard]] Duration expiry_lateness() const noexcept override { return lateness; }
  [[nodiscard]] double rate() const { return clock_.history().rate_at(source_.now()).ratio(); }

  bool refuse = false;
  Duration ends_late_by{};  ///< the corrections of the next commands
  Duration lateness{};      ///< what it says of that
  double largest_change = 0.0;
  ServoCommand last{};

 private:
  FreeRunningSource& source_;
  VirtualClock clock_;
};

}  // namespace ftcs::test
