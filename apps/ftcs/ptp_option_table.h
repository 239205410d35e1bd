// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "ftcs/daemon/ptp_options.h"

namespace ftcs::app {

/// A setting of ptp4l's configuration file, which is also `--name value` on the command line.
struct PtpSetting {
  const char* name;
  const char* help;  ///< unit and range
  /// Returns what is wrong with the value, if anything.
  std::optional<std::string> (*set)(daemon::PtpOptions& options, std::string_view value);
};

/// "001122.fffe.334455"
[[nodiscard]] std::optional<ptp::ClockIdentity> parse_clock_identity(std::string_view text);

/// The settings that have an effect.
[[nodiscard]] std::span<const PtpSetting> ptp_settings();

/// Applies one setting by ptp4l's name. Settings of ptp4l that have no effect here are accepted
/// with the one value that describes what happens anyway (its default, mostly), and are an error
/// with any other.
[[nodiscard]] std::optional<std::string> apply_setting(daemon::PtpOptions& options,
                                                       std::string_view name,
                                                       std::string_view value);

}  // namespace ftcs::app
