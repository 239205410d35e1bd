// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>

#include "ftcs/diagnosis/port_diagnosis.h"

namespace ftcs::diagnosis {

/// No value: that is not what is wrong.
using PortRule = std::optional<Finding> (*)(const PortSeen& seen);

/// While no transmitter is selected, in order; nothing_heard() is what is left.
[[nodiscard]] std::span<const PortRule> rules_of_hearing() noexcept;
[[nodiscard]] Finding nothing_heard(const PortSeen& seen);
/// While one is, in order.
[[nodiscard]] std::span<const PortRule> rules_of_measuring() noexcept;

[[nodiscard]] std::string name(Way way);
/// The flag that chooses it: -4, -6 or -2.
[[nodiscard]] std::string flag(Way way);
/// Whether those messages are what the port listens to, as far as the wire tells.
[[nodiscard]] bool is_for(const Talker& talker, const PortSettings& settings) noexcept;

}  // namespace ftcs::diagnosis
