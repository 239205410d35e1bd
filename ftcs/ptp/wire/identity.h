// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string_view>

namespace ftcs::ptp {

/// IEEE 1588-2019, 5.3.4 ClockIdentity: eight octets, usually an EUI-64.
struct ClockIdentity {
  std::array<std::uint8_t, 8> octets{};

  /// From a 48-bit interface address, with FF FE in the middle (7.5.2.2.2, EUI-48 mapped to
  /// EUI-64).
  [[nodiscard]] static constexpr ClockIdentity from_mac(
      const std::array<std::uint8_t, 6>& mac) noexcept {
    return {{mac[0], mac[1], mac[2], 0xFF, 0xFE, mac[3], mac[4], mac[5]}};
  }
  friend constexpr auto operator<=>(const ClockIdentity&, const ClockIdentity&) noexcept = default;
  friend constexpr bool operator==(const ClockIdentity&, const ClockIdentity&) noexcept = default;
};

/// IEEE 1588-2019, 5.3.5 PortIdentity; ports count from 1.
struct PortIdentity {
  ClockIdentity clock{};
  std::uint16_t port = 0;

  friend constexpr auto operator<=>(const PortIdentity&, const PortIdentity&) noexcept = default;
  friend constexpr bool operator==(const PortIdentity&, const PortIdentity&) noexcept = default;
};

/// An identity as readers of ptp4l's log know it, without heap.
struct IdentityText {
  std::array<char, 24> characters{};
  std::uint8_t size = 0;
  [[nodiscard]] constexpr std::string_view view() const noexcept {
    return {characters.data(), size};
  }
};

/// "001b21.fffe.a1b2c3"
[[nodiscard]] IdentityText to_text(const ClockIdentity& identity) noexcept;
/// "001b21.fffe.a1b2c3-1"
[[nodiscard]] IdentityText to_text(const PortIdentity& identity) noexcept;

}  // namespace ftcs::ptp
