// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <netinet/in.h>
#include <optional>
#include <string>
#include <sys/socket.h>

namespace ftcs::platform {

/// A 48-bit Ethernet address.
using MacAddress = std::array<std::uint8_t, 6>;

/// The address of a socket of any of the three families that PTP uses.
class SocketAddress {
 public:
  SocketAddress() = default;
  /// A port in host order. `scope`: index of the interface, for addresses of one link.
  [[nodiscard]] static SocketAddress ipv4(in_addr address, std::uint16_t port) noexcept;
  [[nodiscard]] static SocketAddress ipv6(const in6_addr& address, std::uint16_t port,
                                          std::uint32_t scope) noexcept;
  /// A packet socket's: protocol in host order.
  [[nodiscard]] static SocketAddress ethernet(const MacAddress& address, std::uint16_t protocol,
                                              int interface) noexcept;
  /// What the kernel wrote as the sender of a message.
  [[nodiscard]] static SocketAddress from(const sockaddr_storage& storage) noexcept;

  [[nodiscard]] const sockaddr* get() const noexcept {
    return reinterpret_cast<const sockaddr*>(&storage_);
  }
  [[nodiscard]] socklen_t size() const noexcept { return size_; }
  [[nodiscard]] int family() const noexcept { return storage_.ss_family; }
  /// UDP port in host order; 0 where the family has none.
  [[nodiscard]] std::uint16_t port() const noexcept;
  /// The same host at another UDP port; unchanged where the family has none.
  [[nodiscard]] SocketAddress with_port(std::uint16_t port) const noexcept;
  /// The same address on the interface with this index, where the family needs to be told.
  [[nodiscard]] SocketAddress on_interface(int index) const noexcept;
  /// The same address, whatever the port and the interface.
  [[nodiscard]] bool is_same_host(const SocketAddress& other) const noexcept;
  /// "10.77.0.1", "ff0e::181", "01-1b-19-00-00-00".
  [[nodiscard]] std::string host() const;

 private:
  template <class Address>
  [[nodiscard]] static SocketAddress wrap(const Address& address) noexcept;
  template <class Address>
  [[nodiscard]] Address as() const noexcept;

  sockaddr_storage storage_{};
  socklen_t size_ = 0;
};

/// "001122334455", "00:11:22:33:44:55" or "00-11-22-33-44-55".
[[nodiscard]] std::optional<MacAddress> parse_mac(const std::string& text);

}  // namespace ftcs::platform
