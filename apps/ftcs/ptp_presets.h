// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "ftcs/daemon/ptp_options.h"

namespace ftcs::app {

/// Settings that belong together, by the name of their profile. Configuration file and command line
/// are applied after it.
[[nodiscard]] std::optional<std::string> apply_preset(daemon::PtpOptions& options,
                                                      std::string_view name);

/// "default-e2e, default-p2p, gptp"
[[nodiscard]] std::string preset_names();

}  // namespace ftcs::app
