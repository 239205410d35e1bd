// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

namespace ftcs::ptp {

/// IEEE 1588-2019, 8.2.15.3.1, Table 20: names and values, as ptp4l prints and reports them too.
enum class PortState : std::uint8_t {
  kInitializing = 1,        ///< not started: everything is ignored
  kFaulty = 2,              ///< the link is down: everything is ignored
  kDisabled = 3,            ///< not used here
  kListening = 4,           ///< no transmitter is selected
  kPreTimeTransmitter = 5,  ///< not used here: a transmitter has no rival to wait for
  kTimeTransmitter = 6,     ///< MASTER
  kPassive = 7,             ///< not used here: there is one port
  kUncalibrated = 8,        ///< a transmitter is followed, the servo is not locked
  kTimeReceiver = 9,        ///< SLAVE: the servo is locked
};

/// What makes a port change its state (9.2.6, Figure 30 and Figure 31).
enum class PortEvent : std::uint8_t {
  kInitComplete,                   ///< it was started, or the link is back
  kFaultDetected,                  ///< the link is down
  kAnnounceReceiptTimeoutExpires,  ///< the transmitter fell silent
  kSynchronizationFault,           ///< the servo has lost its lock
  kTransmitterClockSelected,       ///< the servo is locked to the transmitter
  kRecommendedTransmitter,         ///< state decision: nobody is better than we are
  kRecommendedReceiver,            ///< state decision: a transmitter is to be followed
};

/// The words of ptp4l's log, which parsers of that log depend on: "LISTENING", "SLAVE" ...
[[nodiscard]] std::string_view to_string(PortState state) noexcept;
/// "RS_SLAVE", "MASTER_CLOCK_SELECTED" ...
[[nodiscard]] std::string_view to_string(PortEvent event) noexcept;

}  // namespace ftcs::ptp
