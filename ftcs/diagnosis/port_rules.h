// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ftcs/diagnosis/port_diagnosis.h"

namespace ftcs::diagnosis {

/// No value: that is not what is wrong.
using PortRule = std::optional<Finding> (*)(const PortSeen& seen);

/// While no transmitter is selected, in order; nothing_heard() is what is left.
[[nodiscard]] std::span<const PortRule> rules_of_hearing() noexcept;
/// IEEE 802.3: all are for another group address. Who listens to the whole wire hears them, a port
/// by itself does not, on most adapters.
[[nodiscard]] std::optional<Finding> other_group(const PortSeen& seen);
[[nodiscard]] Finding nothing_heard(const PortSeen& seen);
/// While one is, in order.
[[nodiscard]] std::span<const PortRule> rules_of_measuring() noexcept;

/// Times that a real clock does not follow; a virtual one does.
[[nodiscard]] std::vector<Finding> refusals_of_time(const PortSeen& seen);
/// What keeps nobody from locking, and is worth a word.
[[nodiscard]] std::vector<Finding> remarks(const PortSeen& seen);
/// Another program changes the clock that is steered.
[[nodiscard]] std::optional<Finding> other_steers(const PortSeen& seen);
/// The real clock is too far from the reference, and nobody allows a step.
[[nodiscard]] std::optional<Finding> far_at_start(const PortSeen& seen);
/// Two transmitters call themselves the same.
[[nodiscard]] std::optional<Finding> one_identity(const PortSeen& seen);
/// The neighbour of a port that measures peer to peer does not answer.
[[nodiscard]] std::optional<Finding> no_peer(const PortSeen& seen);

[[nodiscard]] std::string name(Way way);
/// The flag that chooses it: -4, -6 or -2.
[[nodiscard]] std::string flag(Way way);
/// Whether those messages are what the port listens to, as far as the wire tells.
[[nodiscard]] bool is_for(const Talker& talker, const PortSettings& settings) noexcept;

}  // namespace ftcs::diagnosis
