// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/ptp/wire/identity.h"
#include "ftcs/ptp/wire/message.h"

namespace ftcs::diagnosis {

/// How a PTP message travels: Annexes C, D and E of IEEE 1588-2019.
enum class Way : std::uint8_t { kUdpIpv4, kUdpIpv6, kEthernet };

/// One port that was heard, as far as its messages are of one kind. Nothing is checked beyond the
/// header: those whom a port does not listen to are what is wanted here.
struct Talker {
  Way way = Way::kUdpIpv4;
  std::uint16_t vlan = 0;  ///< 802.1Q identifier; 0: untagged
  std::uint8_t version = 2;
  std::uint8_t domain = 0;
  std::uint8_t major_sdo_id = 0;
  bool to_group = true;                       ///< the destination is a multicast address
  std::array<std::uint8_t, 6> destination{};  ///< Ethernet; known of frames alone
  ptp::PortIdentity port{};                   ///< of version 2
  std::array<std::uint32_t, 16> messages{};   ///< by type
  bool two_step = false;                      ///< the flag of its last Sync
  std::uint16_t announce_flags = 0;           ///< of its last Announce
  std::int16_t utc_offset = 0;                ///< likewise
  /// What its last one-step Sync or Follow_Up showed, whole seconds since its epoch; none: nothing.
  std::optional<std::int64_t> shown_s{};

  [[nodiscard]] std::uint32_t count(ptp::MessageType type) const noexcept {
    return messages[static_cast<std::size_t>(type)];
  }
  [[nodiscard]] bool announces() const noexcept { return count(ptp::MessageType::kAnnounce) > 0; }
  [[nodiscard]] bool transmits() const noexcept {
    return announces() || count(ptp::MessageType::kSync) > 0;
  }
};

/// Who talks PTP: of the messages at a port's own sockets, or of all frames of a wire. Bounded
/// work, no heap; whom the table has no room for is not noted.
class Talkers {
 public:
  static constexpr std::size_t kCapacity = 32;

  /// Whose messages are our own.
  void set_own(const ptp::ClockIdentity& own) noexcept { own_ = own; }
  /// Forgets whom it heard.
  void clear() noexcept { size_ = 0; }
  /// A message as it came to a socket.
  void on_message(std::span<const std::uint8_t> message, Way way) noexcept;
  /// An Ethernet frame, tags included; other than PTP is ignored.
  void on_frame(std::span<const std::uint8_t> frame) noexcept;

  [[nodiscard]] std::span<const Talker> all() const noexcept { return {talkers_.data(), size_}; }
  /// The first one of whom that is true; null: none.
  template <class Predicate>
  [[nodiscard]] const Talker* find(const Predicate& is) const noexcept {
    for (const Talker& talker : all()) {
      if (is(talker)) return &talker;
    }
    return nullptr;
  }

 private:
  void note(std::span<const std::uint8_t> message, Talker kind) noexcept;
  [[nodiscard]] Talker* entry(const Talker& kind) noexcept;

  std::array<Talker, kCapacity> talkers_{};
  std::size_t size_ = 0;
  std::optional<ptp::ClockIdentity> own_{};
};

}  // namespace ftcs::diagnosis
