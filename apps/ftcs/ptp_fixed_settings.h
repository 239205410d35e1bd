// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ftcs::app {

/// Settings of ptp4l that describe what happens here anyway.
[[nodiscard]] std::vector<std::string> fixed_setting_names();

[[nodiscard]] bool is_fixed_setting(std::string_view name);

/// What is wrong with another value than the one that happens anyway.
[[nodiscard]] std::optional<std::string> check_fixed_setting(std::string_view name,
                                                             std::string_view value);

}  // namespace ftcs::app
