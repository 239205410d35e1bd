// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/ptp/actions.h"
#include "ftcs/ptp/counters.h"
#include "ftcs/ptp/security_association.h"

namespace ftcs::ptp {

/// What every message of a port has in common.
struct PortConfig {
  PortIdentity identity{};
  std::uint8_t domain = 0;
  std::uint8_t major_sdo_id = 0;
  std::uint8_t minor_version = 1;  ///< of what is sent
  bool unicast = false;            ///< to the one configured peer instead of multicast
  bool assume_two_step = false;    ///< take every Sync and Pdelay_Resp for a two-step one
  /// Every message is sent with an AUTHENTICATION TLV, and dropped without (16.14); null: none.
  const SecurityAssociation* security = nullptr;
};

/// What time receiver, time transmitter and peer delay share: identity, state, counters, and the
/// way of a message in and out.
class Port {
 public:
  explicit Port(const PortConfig& config) noexcept : config_(config) {}

  /// A message that is for this port; else it is counted why not. Not in INITIALIZING and FAULTY.
  [[nodiscard]] std::optional<Message> read(std::span<const std::uint8_t> bytes) noexcept;
  /// Of a message of this port: identity, domain, SDO, version; the unicast flag where it is so.
  [[nodiscard]] Header header(std::uint16_t sequence_id, std::int8_t log_interval) const noexcept;
  /// Counted as `sent`. In unicast operation every destination is the configured peer, but for
  /// answers.
  void send(const Message& message, Destination destination, Counter sent,
            ActionList& actions) noexcept;
  void change_state(PortState to, PortEvent event, ActionList& actions) noexcept;
  /// An action that has no room is counted (kActionsDropped) and lost.
  void push(const Action& action, ActionList& actions) noexcept;
  void count(Counter counter, std::uint64_t times = 1) noexcept { counters_.add(counter, times); }

  [[nodiscard]] const SecurityAssociation* security() const noexcept { return config_.security; }
  [[nodiscard]] const PortIdentity& identity() const noexcept { return config_.identity; }
  [[nodiscard]] PortState state() const noexcept { return state_; }
  /// Neither initializing nor faulty.
  [[nodiscard]] bool is_active() const noexcept {
    return state_ != PortState::kInitializing && state_ != PortState::kFaulty;
  }
  [[nodiscard]] Counters& counters() noexcept { return counters_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] bool is_for_us(const Header& header) noexcept;
  [[nodiscard]] bool is_authentic(std::span<const std::uint8_t> bytes) noexcept;

  PortConfig config_;
  PortState state_ = PortState::kInitializing;
  Counters counters_;
};

}  // namespace ftcs::ptp
