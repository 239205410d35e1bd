// SPDX-License-Identifier: MIT
#include "ftcs/ptp/port_state.h"

#include <cstddef>

namespace ftcs::ptp {

std::string_view to_string(PortState state) noexcept {
  constexpr std::string_view kNames[] = {"NONE",         "INITIALIZING", "FAULTY", "DISABLED",
                                         "LISTENING",    "PRE_MASTER",   "MASTER", "PASSIVE",
                                         "UNCALIBRATED", "SLAVE"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string_view to_string(PortEvent event) noexcept {
  constexpr std::string_view kNames[] = {"INIT_COMPLETE",
                                         "FAULT_DETECTED",
                                         "ANNOUNCE_RECEIPT_TIMEOUT_EXPIRES",
                                         "SYNCHRONIZATION_FAULT",
                                         "MASTER_CLOCK_SELECTED",
                                         "RS_MASTER",
                                         "RS_SLAVE"};
  return kNames[static_cast<std::size_t>(event)];
}

}  // namespace ftcs::ptp
