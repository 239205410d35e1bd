// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "ftcs/daemon/ptp_options.h"

namespace ftcs::app {

/// Reads a file in ptp4l's format: "[global]" and "[INTERFACE]" sections, lines "name value",
/// comments from #. One port: a second interface is an error. Returns "FILE:LINE: what is wrong",
/// or nothing.
[[nodiscard]] std::optional<std::string> read_config_file(const std::string& path,
                                                          daemon::PtpOptions& options);

/// The same from text; `name` stands for the path in messages.
[[nodiscard]] std::optional<std::string> read_config_text(std::string_view text,
                                                          std::string_view name,
                                                          daemon::PtpOptions& options);

}  // namespace ftcs::app
