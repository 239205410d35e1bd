// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "ftcs/platform/clock_device.h"
#include "ftcs/platform/cross_timestamp.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// Two clocks at one instant: `sink` was read within ± delay/2 of `source`.
struct Comparison {
  std::int64_t source_ns = 0;
  std::int64_t sink_ns = 0;
  std::int64_t delay_ns = 0;
};

/// Compares any two clocks of the kernel of which one at least is a PTP hardware clock. Two of
/// those are compared by way of CLOCK_REALTIME, a few microseconds apart: the delays add up.
class ClockComparison {
 public:
  /// Both must outlive this. The error is for the user.
  [[nodiscard]] static Result<ClockComparison, std::string> make(
      platform::Kernel& kernel, const platform::ClockDevice& source,
      const platform::ClockDevice& sink);

  [[nodiscard]] Result<Comparison, platform::OsError> read(int readings);
  /// "extended", or both methods of two hardware clocks.
  [[nodiscard]] std::string method() const;

 private:
  ClockComparison() = default;

  std::optional<platform::CrossTimestamper> source_;  // none: the source is CLOCK_REALTIME
  std::optional<platform::CrossTimestamper> sink_;
};

}  // namespace ftcs::daemon
