// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/daemon/demo_receiver.h"
#include "ftcs/platform/kernel.h"

namespace ftcs::daemon {

/// The first half of the demonstration: a receiver of this process, with all servos at once, and a
/// time transmitter in a process of its own. Says on standard error what went wrong; returns an
/// exit code.
[[nodiscard]] int run_ptp_demo(platform::Kernel& kernel, const DemoOptions& demo,
                               DemoResult& result);

}  // namespace ftcs::daemon
