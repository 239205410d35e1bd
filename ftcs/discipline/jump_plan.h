// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/duration.h"

namespace ftcs {

/// What becomes of a jump of the reference in mid-run.
enum class JumpResponse : std::uint8_t {
  kSlewed,   ///< the clock follows by its rate
  kStepped,  ///< the step policy permits one step
  kRefused,  ///< farther than largest_offset, and no step is permitted: as at the start
};

/// What will be done about it, told before it is done.
struct JumpPlan {
  JumpResponse response = JumpResponse::kSlewed;
  /// How long slewing takes at the fastest rate that is permitted: |jump| / (rate / tracking - 1).
  /// Zero where the clock is not slewed.
  Duration slew{};
};

}  // namespace ftcs
