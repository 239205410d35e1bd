// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/duration.h"

namespace ftcs {

/// ptp4l's step_threshold and first_step_threshold, as one choice.
enum class StepMode : std::uint8_t {
  kNever,   ///< the clock stays continuous; a step that a servo asks for is left out
  kFirst,   ///< only with the first command, and with the first on another timescale
  kAlways,  ///< with any command
};

/// When the clock may be stepped instead of slewed. Default: never, as the paper demands.
///
/// Where the mode permits it, an offset larger than `threshold` is stepped by the discipline
/// whatever the servo is, and a step that the servo itself asks for (linuxptp-pi has thresholds of
/// its own) passes.
struct StepPolicy {
  StepMode mode = StepMode::kNever;
  Nanoseconds threshold{20'000};  ///< of |offset|; zero: any offset that is not zero is stepped

  /// `first_command`: none has been applied since the start or a change of the timescale.
  [[nodiscard]] constexpr bool permits(bool first_command) const noexcept {
    return mode == StepMode::kAlways || (mode == StepMode::kFirst && first_command);
  }
};

}  // namespace ftcs
