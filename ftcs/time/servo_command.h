// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/duration.h"
#include "ftcs/time/rate.h"

namespace ftcs {

/// What a servo asks of a clock. Rates are local time per free-running time; a command replaces its
/// predecessor entirely (never accumulates), so that a lost one is harmless.
///
/// From the moment it is applied the clock runs at correction_rate for correction_time; then,
/// without waiting for another sample, at tracking_rate. Paper eq. 17: correction (1 + p
/// T_offset/T_c) k a, tracking k a. correction_time is a length of *reference* time (the paper's
/// T_c); on the oscillator it lasts correction_time / tracking_rate. Zero means there is no
/// correction: tracking_rate holds at once; a negative one counts as zero.
///
/// A clock 1 ms ahead on a nominal oscillator that shall be right after 125 ms:
///
///     {.correction_rate = Rate::from_ratio(1.0 - 0.008),
///      .correction_time = Nanoseconds{125'000'000}}
///
/// Valid: both rates finite and within the clock's limits (the correction rate only if it is used);
/// AdjustableClock::apply() refuses any other.
struct ServoCommand {
  Rate correction_rate;
  Duration correction_time{};
  Rate tracking_rate;
  Duration step{};  ///< added to the clock first; zero = none. Only if the step policy allows.
};

}  // namespace ftcs
