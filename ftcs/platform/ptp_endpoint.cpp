// SPDX-License-Identifier: MIT
#include "ftcs/platform/ptp_endpoint.h"

#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <utility>

namespace ftcs::platform {
namespace {

constexpr std::uint16_t kEthertype = 0x88F7;               // Annex E
constexpr std::uint32_t kPrimaryMulticast = 0xE0000181;    // 224.0.1.129, Annex C.3
constexpr std::uint32_t kPeerDelayMulticast = 0xE000006B;  // 224.0.0.107, Annex C.3
constexpr int kTold = 1;  // with each message: the address that it was sent to
constexpr std::array kGroups{Group::kPrimary, Group::kPeerDelay};

struct Option {
  int name;
  const void* value;
  socklen_t size;
};

std::optional<OsError> set_all(Kernel& kernel, int fd, int level, std::span<const Option> options,
                               const std::string& what) {
  for (const Option& option : options) {
    const int result = kernel.set_option(fd, level, option.name, option.value, option.size);
    if (result < 0) return os_error(-result, what);
  }
  return std::nullopt;
}

in_addr ipv4_group(Group group) noexcept {
  return {htonl(group == Group::kPrimary ? kPrimaryMulticast : kPeerDelayMulticast)};
}

/// ff0X::181 (X: scope) and ff02::6b, Annex D.3.
in6_addr ipv6_group(Group group, std::uint8_t scope) noexcept {
  in6_addr address{};
  address.s6_addr[0] = 0xFF;
  if (group == Group::kPrimary) {
    address.s6_addr[1] = scope & 0xFU;
    address.s6_addr[14] = 0x01;
    address.s6_addr[15] = 0x81;
  } else {
    address.s6_addr[1] = 0x02;
    address.s6_addr[15] = 0x6B;
  }
  return address;
}

std::uint16_t port_of(const PtpEndpointConfig& config, Channel channel) noexcept {
  return channel == Channel::kEvent ? config.event_port : config.general_port;
}

std::optional<OsError> join_ipv4(Kernel& kernel, int fd, const PtpEndpointConfig& config,
                                 const InterfaceState& interface) {
  const std::string what = "multicast on " + config.interface;
  for (const Group group : kGroups) {
    ip_mreqn request{};
    request.imr_multiaddr = ipv4_group(group);
    request.imr_ifindex = interface.index;
    const std::array join{Option{IP_ADD_MEMBERSHIP, &request, sizeof request}};
    if (auto error = set_all(kernel, fd, IPPROTO_IP, join, what)) return error;
  }
  ip_mreqn outgoing{};
  outgoing.imr_ifindex = interface.index;
  // On loopback the copy for ourselves is the only way to the neighbour process.
  const int loop = interface.loopback ? 1 : 0;
  const int only_joined = 0;
  const std::array options{Option{IP_MULTICAST_IF, &outgoing, sizeof outgoing},
                           Option{IP_MULTICAST_LOOP, &loop, sizeof loop},
                           Option{IP_MULTICAST_ALL, &only_joined, sizeof only_joined},
                           Option{IP_MULTICAST_TTL, &config.ttl, sizeof config.ttl},
                           Option{IP_PKTINFO, &kTold, sizeof kTold}};
  return set_all(kernel, fd, IPPROTO_IP, options, what);
}

std::optional<OsError> join_ipv6(Kernel& kernel, int fd, const PtpEndpointConfig& config,
                                 const InterfaceState& interface) {
  const std::string what = "multicast on " + config.interface;
  for (const Group group : kGroups) {
    ipv6_mreq request{};
    request.ipv6mr_multiaddr = ipv6_group(group, config.ipv6_scope);
    request.ipv6mr_interface = static_cast<unsigned>(interface.index);
    const std::array join{Option{IPV6_ADD_MEMBERSHIP, &request, sizeof request}};
    if (auto error = set_all(kernel, fd, IPPROTO_IPV6, join, what)) return error;
  }
  const int loop = interface.loopback ? 1 : 0;
  const std::array options{Option{IPV6_MULTICAST_IF, &interface.index, sizeof interface.index},
                           Option{IPV6_MULTICAST_LOOP, &loop, sizeof loop},
                           Option{IPV6_MULTICAST_HOPS, &config.ttl, sizeof config.ttl},
                           Option{IPV6_RECVPKTINFO, &kTold, sizeof kTold}};
  return set_all(kernel, fd, IPPROTO_IPV6, options, what);
}

std::optional<OsError> open_udp(Kernel& kernel, int fd, const PtpEndpointConfig& config,
                                const InterfaceState& interface, Channel channel) {
  const std::string& name = config.interface;
  const bool ipv6 = config.transport == NetworkTransport::kUdpIpv6;
  if (!ipv6) {
    if (auto error = missing_ipv4_address(kernel, fd, name)) return error;
  }
  // The name with its terminating zero. Without the right (kernels before 5.7) the multicast
  // membership alone keeps other interfaces' messages out.
  const int bound = kernel.set_option(fd, SOL_SOCKET, SO_BINDTODEVICE, name.c_str(),
                                      static_cast<socklen_t>(name.size() + 1));
  if (bound < 0 && bound != -EPERM) return os_error(-bound, "interface " + name);

  // Multicast: several programs of one host may listen. Unicast: a port belongs to one.
  const int share = config.unicast ? 0 : 1;
  const int on = 1;
  const std::array socket_options{Option{SO_REUSEADDR, &share, sizeof share}};
  if (auto error = set_all(kernel, fd, SOL_SOCKET, socket_options, "socket")) return error;
  const std::array ipv6_options{Option{IPV6_V6ONLY, &on, sizeof on}};
  if (ipv6) {
    if (auto error = set_all(kernel, fd, IPPROTO_IPV6, ipv6_options, "socket")) return error;
  }
  const std::uint16_t port = port_of(config, channel);
  const int result = kernel.bind(
      fd, ipv6 ? SocketAddress::ipv6(in6addr_any, port, 0) : SocketAddress::ipv4({}, port));
  if (result < 0) {
    const bool low = port < IPPORT_RESERVED && (result == -EACCES || result == -EPERM);
    return os_error(-result, "UDP port " + std::to_string(port) + (low ? " (below 1024)" : ""));
  }
  if (config.unicast) return std::nullopt;
  return ipv6 ? join_ipv6(kernel, fd, config, interface) : join_ipv4(kernel, fd, config, interface);
}

/// messageType is the low half of the first octet; event messages have the types below 8. In a
/// cooked packet socket the message begins at offset 0.
std::optional<OsError> keep_channel(Kernel& kernel, int fd, Channel channel) {
  constexpr std::uint32_t kAll = 0xFFFF;
  constexpr std::uint32_t kFirstGeneralType = 8;
  const std::uint32_t event = channel == Channel::kEvent ? kAll : 0;
  const std::uint32_t general = channel == Channel::kEvent ? 0 : kAll;
  std::array<sock_filter, 5> program{{{BPF_LD | BPF_B | BPF_ABS, 0, 0, 0},
                                      {BPF_ALU | BPF_AND | BPF_K, 0, 0, 0xF},
                                      {BPF_JMP | BPF_JGE | BPF_K, 1, 0, kFirstGeneralType},
                                      {BPF_RET | BPF_K, 0, 0, event},
                                      {BPF_RET | BPF_K, 0, 0, general}}};
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  const std::array options{Option{SO_ATTACH_FILTER, &filter, sizeof filter}};
  return set_all(kernel, fd, SOL_SOCKET, options, "packet filter");
}

std::optional<OsError> open_ethernet(Kernel& kernel, int fd, const PtpEndpointConfig& config,
                                     const InterfaceState& interface, Channel channel) {
  // Without a protocol the socket hears nothing until it is bound: no message slips by the filter.
  if (auto error = keep_channel(kernel, fd, channel)) return error;
  const int result = kernel.bind(fd, SocketAddress::ethernet({}, kEthertype, interface.index));
  if (result < 0) return os_error(-result, "interface " + config.interface);
  for (const Group group : kGroups) {
    const MacAddress& mac = group == Group::kPrimary ? config.primary_mac : config.peer_mac;
    packet_mreq request{};
    request.mr_ifindex = interface.index;
    request.mr_type = PACKET_MR_MULTICAST;
    request.mr_alen = static_cast<unsigned short>(mac.size());
    std::copy(mac.begin(), mac.end(), request.mr_address);
    const std::array join{Option{PACKET_ADD_MEMBERSHIP, &request, sizeof request}};
    const std::string what = "multicast on " + config.interface;
    if (auto error = set_all(kernel, fd, SOL_PACKET, join, what)) return error;
  }
  return std::nullopt;
}

int family_of(NetworkTransport transport) noexcept {
  switch (transport) {
    case NetworkTransport::kUdpIpv4:
      return AF_INET;
    case NetworkTransport::kUdpIpv6:
      return AF_INET6;
    case NetworkTransport::kEthernet:
      break;
  }
  return AF_PACKET;
}

constexpr std::array<std::pair<NetworkTransport, const char*>, 3> kNames{
    {{NetworkTransport::kUdpIpv4, "UDPv4"},
     {NetworkTransport::kUdpIpv6, "UDPv6"},
     {NetworkTransport::kEthernet, "L2"}}};

}  // namespace

const char* name(NetworkTransport transport) noexcept {
  return kNames[static_cast<std::size_t>(transport)].second;
}

std::optional<NetworkTransport> transport_from_name(std::string_view name) noexcept {
  for (const auto& [transport, known] : kNames) {
    if (name == known) return transport;
  }
  return std::nullopt;
}

Result<Descriptor, OsError> open_endpoint(Kernel& kernel, const PtpEndpointConfig& config,
                                          const InterfaceState& interface, Channel channel) {
  const int fd = kernel.socket(family_of(config.transport), SOCK_DGRAM);
  if (fd < 0) {
    const bool packet = config.transport == NetworkTransport::kEthernet;
    return os_error(-fd, packet ? "packet socket" : "socket");
  }
  Descriptor owner(kernel, fd);
  if (const int result = kernel.set_nonblocking(fd); result < 0) {
    return os_error(-result, "socket");
  }
  auto error = config.transport == NetworkTransport::kEthernet
                   ? open_ethernet(kernel, fd, config, interface, channel)
                   : open_udp(kernel, fd, config, interface, channel);
  if (error) return std::move(*error);
  return owner;
}

SocketAddress destination_of(const PtpEndpointConfig& config, int interface_index, Channel channel,
                             Group group) noexcept {
  const std::uint16_t port = port_of(config, channel);
  if (config.unicast) return config.unicast->with_port(port).on_interface(interface_index);
  switch (config.transport) {
    case NetworkTransport::kUdpIpv4:
      return SocketAddress::ipv4(ipv4_group(group), port);
    case NetworkTransport::kUdpIpv6:
      return SocketAddress::ipv6(ipv6_group(group, config.ipv6_scope), port,
                                 static_cast<std::uint32_t>(interface_index));
    case NetworkTransport::kEthernet:
      break;
  }
  return SocketAddress::ethernet(group == Group::kPrimary ? config.primary_mac : config.peer_mac,
                                 kEthertype, interface_index);
}

std::size_t padding_of(NetworkTransport transport) noexcept {
  return transport == NetworkTransport::kUdpIpv6 ? 2 : 0;
}

std::optional<SocketAddress> parse_peer(NetworkTransport transport, const std::string& text) {
  switch (transport) {
    case NetworkTransport::kUdpIpv4: {
      const auto address = parse_ipv4(text);
      if (!address) return std::nullopt;
      return SocketAddress::ipv4(*address, 0);
    }
    case NetworkTransport::kUdpIpv6: {
      in6_addr address{};
      if (::inet_pton(AF_INET6, text.c_str(), &address) != 1) return std::nullopt;
      return SocketAddress::ipv6(address, 0, 0);
    }
    case NetworkTransport::kEthernet:
      break;
  }
  const auto mac = parse_mac(text);
  if (!mac) return std::nullopt;
  return SocketAddress::ethernet(*mac, kEthertype, 0);
}

}  // namespace ftcs::platform
