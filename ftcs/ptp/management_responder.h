// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "ftcs/ptp/wire/management.h"

namespace ftcs::ptp {

/// What a port tells about itself: IEEE 1588-2019, 8.2, and linuxptp's additions.
struct ManagedPort {
  PortIdentity identity{};
  std::uint8_t domain = 0;
  std::uint8_t major_sdo_id = 0;
  ClockDescription description{};
  UserDescription user{};
  DefaultDataSet default_set{};
  CurrentDataSet current{};
  ParentDataSet parent{};
  TimePropertiesDataSet time_properties{};
  PortDataSet port{};
  TimeStatusNp time_status{};
  PortDataSetNp port_np{};
  PortPropertiesNp properties{};
  PortStatsNp stats{};
  SubscribeEventsNp subscription{};  ///< of who asks
};

/// Since construction; every request is in one of them.
struct ManagementCounters {
  std::uint64_t answered = 0;
  std::uint64_t refused = 0;    ///< answered with MANAGEMENT_ERROR_STATUS
  std::uint64_t ignored = 0;    ///< other domain, SDO or clock; nothing that can be asked
  std::uint64_t malformed = 0;  ///< no management message
};

/// Answers management messages: GET with a RESPONSE, everything else with an error status, as
/// nothing can be set but a subscription. What is addressed to somebody else is not answered
/// (15.3.1).
///
/// Sans-I/O; the caller sends what is returned to where the request came from.
class ManagementResponder {
 public:
  /// The RESPONSE to a GET, or a MANAGEMENT_ERROR_STATUS (15.5.4): kNoSuchId for what we do not
  /// know, kWrongValue for a port that we are not, kNotSetable for a SET, kNotSupported for a
  /// COMMAND. None: not for us, or no management message; counted.
  [[nodiscard]] std::optional<ManagementBytes> answer(std::span<const std::uint8_t> request,
                                                      const ManagedPort& port) noexcept;
  /// Who wants to be told of what, where the request just answered has said so: linuxptp's phc2sys
  /// -a does.
  struct Subscription {
    PortIdentity subscriber{};
    SubscribeEventsNp wanted{};
  };
  [[nodiscard]] std::optional<Subscription> take_subscription() noexcept {
    return std::exchange(subscription_, std::nullopt);
  }
  /// What a subscriber is told when the state of the port has changed: a RESPONSE that nobody asked
  /// for, with the PORT_DATA_SET.
  [[nodiscard]] static ManagementBytes port_state_notice(const ManagedPort& port,
                                                         const PortIdentity& subscriber,
                                                         std::uint16_t sequence_id) noexcept;
  [[nodiscard]] const ManagementCounters& counters() const noexcept { return counters_; }

 private:
  ManagementCounters counters_{};
  std::optional<Subscription> subscription_{};
};

}  // namespace ftcs::ptp
