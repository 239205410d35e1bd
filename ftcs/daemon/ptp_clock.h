// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "ftcs/daemon/ptp_options.h"
#include "ftcs/daemon/real_clock.h"
#include "ftcs/platform/timestamp_clock.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// Where a port's timestamps come from, and the real clock that they are readings of, if one is
/// steered.
struct PtpClocks {
  std::unique_ptr<platform::TimestampClock> timestamps;
  std::unique_ptr<RealClock> real{};  ///< null: virtual
};

/// As the options ask. The error is one line for the user; no clock has been touched then.
[[nodiscard]] Result<PtpClocks, std::string> open_ptp_clocks(platform::Kernel& kernel,
                                                             const PtpOptions& options, Log& log);

}  // namespace ftcs::daemon
