// SPDX-License-Identifier: MIT
#include "ftcs/platform/socket_address.h"

#include <algorithm>
#include <arpa/inet.h>
#include <cstdio>
#include <cstring>
#include <linux/if_packet.h>

namespace ftcs::platform {
namespace {

constexpr int kHexadecimal = 16;

}  // namespace

template <class Address>
SocketAddress SocketAddress::wrap(const Address& address) noexcept {
  static_assert(sizeof(Address) <= sizeof(sockaddr_storage));
  SocketAddress wrapped;
  std::memcpy(&wrapped.storage_, &address, sizeof address);
  wrapped.size_ = sizeof address;
  return wrapped;
}

template <class Address>
Address SocketAddress::as() const noexcept {
  Address address{};
  std::memcpy(&address, &storage_, sizeof address);
  return address;
}

SocketAddress SocketAddress::ipv4(in_addr address, std::uint16_t port) noexcept {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  result.sin_addr = address;
  return wrap(result);
}

SocketAddress SocketAddress::ipv6(const in6_addr& address, std::uint16_t port,
                                  std::uint32_t scope) noexcept {
  sockaddr_in6 result{};
  result.sin6_family = AF_INET6;
  result.sin6_port = htons(port);
  result.sin6_addr = address;
  result.sin6_scope_id = scope;
  return wrap(result);
}

SocketAddress SocketAddress::ethernet(const MacAddress& address, std::uint16_t protocol,
                                      int interface) noexcept {
  sockaddr_ll result{};
  result.sll_family = AF_PACKET;
  result.sll_protocol = htons(protocol);
  result.sll_ifindex = interface;
  result.sll_halen = static_cast<unsigned char>(address.size());
  std::copy(address.begin(), address.end(), result.sll_addr);
  return wrap(result);
}

SocketAddress SocketAddress::from(const sockaddr_storage& storage) noexcept {
  SocketAddress address;
  address.storage_ = storage;
  switch (storage.ss_family) {
    case AF_INET:
      address.size_ = sizeof(sockaddr_in);
      break;
    case AF_INET6:
      address.size_ = sizeof(sockaddr_in6);
      break;
    case AF_PACKET:
      address.size_ = sizeof(sockaddr_ll);
      break;
    default:
      break;
  }
  return address;
}

std::uint16_t SocketAddress::port() const noexcept {
  if (family() == AF_INET) return ntohs(as<sockaddr_in>().sin_port);
  if (family() == AF_INET6) return ntohs(as<sockaddr_in6>().sin6_port);
  return 0;
}

SocketAddress SocketAddress::with_port(std::uint16_t port) const noexcept {
  if (family() == AF_INET) return ipv4(as<sockaddr_in>().sin_addr, port);
  if (family() == AF_INET6) {
    const auto address = as<sockaddr_in6>();
    return ipv6(address.sin6_addr, port, address.sin6_scope_id);
  }
  return *this;
}

SocketAddress SocketAddress::on_interface(int index) const noexcept {
  if (family() == AF_INET6) {
    const auto address = as<sockaddr_in6>();
    const bool one_link =
        IN6_IS_ADDR_LINKLOCAL(&address.sin6_addr) || IN6_IS_ADDR_MC_LINKLOCAL(&address.sin6_addr);
    return one_link ? ipv6(address.sin6_addr, ntohs(address.sin6_port),
                           static_cast<std::uint32_t>(index))
                    : *this;
  }
  if (family() == AF_PACKET) {
    auto address = as<sockaddr_ll>();
    address.sll_ifindex = index;
    return wrap(address);
  }
  return *this;
}

bool SocketAddress::is_same_host(const SocketAddress& other) const noexcept {
  if (family() != other.family()) return false;
  switch (family()) {
    case AF_INET:
      return as<sockaddr_in>().sin_addr.s_addr == other.as<sockaddr_in>().sin_addr.s_addr;
    case AF_INET6: {
      const auto ours = as<sockaddr_in6>();
      const auto theirs = other.as<sockaddr_in6>();
      return std::memcmp(&ours.sin6_addr, &theirs.sin6_addr, sizeof ours.sin6_addr) == 0;
    }
    case AF_PACKET: {
      const auto ours = as<sockaddr_ll>();
      const auto theirs = other.as<sockaddr_ll>();
      return std::memcmp(ours.sll_addr, theirs.sll_addr, sizeof(MacAddress)) == 0;
    }
    default:
      return false;
  }
}

std::string SocketAddress::host() const {
  char text[INET6_ADDRSTRLEN] = "";
  if (family() == AF_INET) {
    const auto address = as<sockaddr_in>();
    ::inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
  } else if (family() == AF_INET6) {
    const auto address = as<sockaddr_in6>();
    ::inet_ntop(AF_INET6, &address.sin6_addr, text, sizeof text);
  } else if (family() == AF_PACKET) {
    const auto address = as<sockaddr_ll>();
    const unsigned char* const a = address.sll_addr;
    std::snprintf(text, sizeof text, "%02x-%02x-%02x-%02x-%02x-%02x", a[0], a[1], a[2], a[3], a[4],
                  a[5]);
  }
  return text;
}

std::optional<MacAddress> parse_mac(const std::string& text) {
  std::string digits;
  for (const char c : text) {
    if (c != ':' && c != '-') digits.push_back(c);
  }
  MacAddress address{};
  const bool hexadecimal = digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  if (digits.size() != 2 * address.size() || !hexadecimal) return std::nullopt;
  for (std::size_t i = 0; i < address.size(); ++i) {
    address[i] =
        static_cast<std::uint8_t>(std::stoul(digits.substr(2 * i, 2), nullptr, kHexadecimal));
  }
  return address;
}

}  // namespace ftcs::platform
