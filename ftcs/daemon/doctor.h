// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/daemon/ptp_options.h"
#include "ftcs/diagnosis/port_diagnosis.h"
#include "ftcs/platform/kernel.h"

namespace ftcs::daemon {

/// What a look at one port and at the whole of its wire came to.
struct Examination {
  std::vector<diagnosis::Finding> findings;  ///< the decisive one first
  std::vector<diagnosis::Talker> heard;      ///< everybody who talks PTP
  std::optional<std::string> wire_unheard;   ///< why the wire could not be listened to
  bool listened = false;                     ///< false: what is wrong was known before
};

/// Follows the transmitter for options.duration with a virtual clock, whatever clock the options
/// name, and listens to all frames of the interface meanwhile. No clock of the machine is touched;
/// what is sent is Delay_Req or Pdelay_Req, from a port of its own number. `listens` is called
/// before the listening begins, unless what is wrong is known without it.
[[nodiscard]] Examination examine(platform::Kernel& kernel, const PtpOptions& options,
                                  const std::function<void()>& listens = {});

}  // namespace ftcs::daemon
