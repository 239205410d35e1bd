// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

namespace ftcs::ptp {

/// IEEE 1588-2019, 8.2.15.3.1, Table 20: names and values, as ptp4l prints and reports them too.
enum class PortState : std::uint8_t {
  kInitializing = 1,
  kFaulty = 2,
  kDisabled = 3,
  kListening = 4,
  kPreTimeTransmitter = 5,
  kTimeTransmitter = 6,
  kPassive = 7,
  kUncalibrated = 8,
  kTimeReceiver = 9,
};

/// What makes a port change its state (9.2.6, Figure 30 and Figure 31).
enum class PortEvent : std::uint8_t {
  kInitComplete,
  kFaultDetected,
  kAnnounceReceiptTimeoutExpires,
  kSynchronizationFault,
  kTransmitterClockSelected,
  kRecommendedTransmitter,
  kRecommendedReceiver,
};

/// The words of ptp4l's log, which parsers of that log depend on: "LISTENING", "SLAVE" ...
[[nodiscard]] std::string_view to_string(PortState state) noexcept;
/// "RS_SLAVE", "MASTER_CLOCK_SELECTED" ...
[[nodiscard]] std::string_view to_string(PortEvent event) noexcept;

}  // namespace ftcs::ptp
