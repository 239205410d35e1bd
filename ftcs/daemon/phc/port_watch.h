// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/daemon/management_client.h"
#include "ftcs/daemon/real_clock.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/ptp/port_state.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// What a PTP program of this machine (ptp4l, ftcs ptp) says about its port over its management
/// socket: asked once a second, never waited for.
class PortWatch {
 public:
  [[nodiscard]] static Result<PortWatch, platform::OsError> open(const PortAddress& address);

  /// Reads what has come, and asks again when a second has passed. `now_ns`: any monotonic clock.
  void attend(std::int64_t now_ns);

  struct Port {
    ptp::PortState state = ptp::PortState::kInitializing;
    bool hardware_timestamps = false;
    std::string interface;
    ReferenceScale scale{};
    std::uint64_t scale_answers = 0;  ///< how often it has told the scale
  };
  /// No value: no complete answer for five seconds.
  [[nodiscard]] const std::optional<Port>& port() const { return port_; }
  /// It follows a transmitter.
  [[nodiscard]] bool is_receiving() const {
    return port_ && port_->state == ptp::PortState::kTimeReceiver;
  }
  [[nodiscard]] bool is_transmitting() const {
    return port_ && port_->state == ptp::PortState::kTimeTransmitter;
  }

 private:
  explicit PortWatch(ManagementClient client) : client_(std::move(client)) {}

  void take(const ptp::ManagementData& data, std::int64_t now_ns);

  ManagementClient client_;
  std::optional<Port> port_;
  std::optional<ptp::PortPropertiesNp> properties_;
  std::optional<ReferenceScale> scale_;
  std::uint64_t scale_answers_ = 0;
  std::optional<std::int64_t> asked_ns_;
  std::int64_t answered_ns_ = 0;
};

/// -a: which clock follows which.
struct Pairing {
  std::string interface;   ///< of the hardware clock
  bool port_leads = true;  ///< the system clock follows it; false: it follows the system clock
  friend bool operator==(const Pairing&, const Pairing&) = default;
};
/// No value: neither follows. `system_may_lead`: a port that transmits follows the system clock.
[[nodiscard]] std::optional<Pairing> pairing(const PortWatch& watch, bool system_may_lead);

}  // namespace ftcs::daemon
