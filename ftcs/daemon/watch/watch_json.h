// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include "ftcs/daemon/watch/watch_history.h"
#include "ftcs/daemon/watch/watch_state.h"

namespace ftcs::daemon {

/// One object on one line; what is not known is null.
[[nodiscard]] std::string state_json(const WatchState& state, const WatchHistogram& histogram,
                                     const std::vector<StabilityPoint>& adev,
                                     const std::vector<StabilityPoint>& tdev);
/// [[time_s, offset_ns, sigma_ns, rate_ppb, delay_ns, used], ...]
[[nodiscard]] std::string points_json(std::span<const WatchPoint> points);

}  // namespace ftcs::daemon
