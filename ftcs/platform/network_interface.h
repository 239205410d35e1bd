// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/platform/kernel.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// What a network interface is at this moment; asked again and again, because links go down,
/// adapters are unplugged and an interface that comes back has another index.
struct InterfaceState {
  int index = 0;
  bool up = false;       ///< administratively up
  bool running = false;  ///< the link has carrier (always true where the kernel does not say)
  bool loopback = false;
};

/// What it can do.
struct InterfaceCapabilities {
  std::array<std::uint8_t, 6> mac{};  ///< all zero on loopback
  bool hardware_timestamps = false;   ///< transmit and receive, with a PTP hardware clock
  bool software_timestamps = false;   ///< transmit and receive, by the kernel
  int phc_index = -1;                 ///< N of /dev/ptpN; -1 without
  std::uint32_t receive_filters = 0;  ///< bit per HWTSTAMP_FILTER_
};

/// `fd`: any datagram socket.
[[nodiscard]] Result<InterfaceState, OsError> interface_state(Kernel& kernel, int fd,
                                                              const std::string& name);
[[nodiscard]] Result<InterfaceCapabilities, OsError> interface_capabilities(
    Kernel& kernel, int fd, const std::string& name);
/// With a socket of its own.
[[nodiscard]] Result<InterfaceState, OsError> interface_state(Kernel& kernel,
                                                              const std::string& name);
[[nodiscard]] Result<InterfaceCapabilities, OsError> interface_capabilities(
    Kernel& kernel, const std::string& name);
/// No value: it has an IPv4 address. Else the reason.
[[nodiscard]] std::optional<OsError> missing_ipv4_address(Kernel& kernel, int fd,
                                                          const std::string& name);

/// Asks the driver to stamp PTP messages in both directions: over UDP, or over IEEE 802.3 itself.
/// Needs CAP_NET_ADMIN, unless they are on already.
[[nodiscard]] std::optional<OsError> enable_hardware_timestamps(
    Kernel& kernel, int fd, const std::string& name, const InterfaceCapabilities& capabilities,
    bool ethernet);

/// Whether they are on already, by a filter that passes what enable_hardware_timestamps() would ask
/// for. Only reads.
[[nodiscard]] bool has_hardware_timestamps_on(Kernel& kernel, const std::string& name,
                                              bool ethernet);

/// A 48-bit address to make a clock identity of: the interface's own or, where it has none
/// (loopback), a locally administered one of this process, so that two processes on loopback are
/// two clocks.
[[nodiscard]] Result<std::array<std::uint8_t, 6>, OsError> identity_address(
    Kernel& kernel, const std::string& name);

/// Dotted decimal.
[[nodiscard]] std::optional<in_addr> parse_ipv4(const std::string& text);

}  // namespace ftcs::platform
