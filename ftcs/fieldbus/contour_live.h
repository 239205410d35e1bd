// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "ftcs/experiment/contour_experiment.h"
#include "ftcs/platform/kernel.h"

namespace ftcs::daemon {

/// The circle of `paper --section 5` over a virtual link: a segment of two drives on loopback and a
/// MainDevice in this process, one run for each way to keep the cycle. Says on standard error what
/// went wrong, and returns nothing then.
[[nodiscard]] std::optional<std::vector<experiment::ContourRow>> run_live_contours(
    platform::Kernel& kernel, const std::function<bool()>& stop);

}  // namespace ftcs::daemon
