// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

namespace ftcs::platform {

/// Why the operating system did not do what was asked, in terms a caller can act on.
enum class OsErrorKind : std::uint8_t {
  kNoSuchInterface,  ///< the network interface does not exist (any more)
  kInterfaceDown,    ///< it exists, but is not up
  kNoAddress,        ///< it has no IPv4 or IPv6 address, whichever is needed
  kBadAddress,       ///< not an address of the kind asked for
  kNotPermitted,     ///< a capability is missing (a port below 1024, a device, a NIC setting)
  kAddressInUse,     ///< another program holds the port
  kTimestampingUnsupported,  ///< the requested kind of timestamp is not to be had
  kNoSuchDevice,             ///< /dev/ptpN is not there
  kForeignFile,              ///< a file that is there holds something else and must stay
  kSystem,                   ///< anything else: see number
};

/// An error as a value: what was tried, on what, and errno.
struct OsError {
  OsErrorKind kind = OsErrorKind::kSystem;
  int number = 0;    ///< errno; 0 if the reason is none of the kernel's
  std::string what;  ///< "interface eth7", "event port 319"

  /// One line for a user: "interface eth7: no such device".
  [[nodiscard]] std::string message() const;
};

/// Sorts an errno into a kind; `what` names the object.
[[nodiscard]] OsError os_error(int number, std::string what);

}  // namespace ftcs::platform
