// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/platform/kernel.h"
#include "ftcs/platform/network_interface.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/platform/socket_address.h"
#include "ftcs/ptp/actions.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

using ptp::Channel;

/// IEEE 1588-2019, Annexes C, D and E.
enum class NetworkTransport : std::uint8_t { kUdpIpv4, kUdpIpv6, kEthernet };
/// "UDPv4", "UDPv6", "L2", as in ptp4l's configuration.
[[nodiscard]] const char* name(NetworkTransport transport) noexcept;
[[nodiscard]] std::optional<NetworkTransport> transport_from_name(std::string_view name) noexcept;

/// The two multicast addresses of a transport.
enum class Group : std::uint8_t {
  kPrimary,    ///< everything but peer delay messages
  kPeerDelay,  ///< never forwarded by a bridge or router
};

/// What may come to an address of our own, instead of a group's. Whoever can route a packet to this
/// host can send such messages; a group's do not leave its network.
enum class UnicastMessages : std::uint8_t {
  kAll,           ///< of a transmitter, which is asked so, and with a configured peer
  kDelayAnswers,  ///< Delay_Resp alone: hybrid end-to-end
  kNone,
};

struct PtpEndpointConfig {
  std::string interface;
  NetworkTransport transport = NetworkTransport::kUdpIpv4;
  std::uint16_t event_port = 319;
  std::uint16_t general_port = 320;
  int ttl = 1;                    ///< of multicast messages over UDP; IPv6: hop limit
  std::uint8_t ipv6_scope = 0xE;  ///< X of ff0X::181 (ptp4l: udp6_scope); 0xE = global
  MacAddress primary_mac{0x01, 0x1B, 0x19, 0x00, 0x00, 0x00};  ///< ptp4l: ptp_dst_mac
  MacAddress peer_mac{0x01, 0x80, 0xC2, 0x00, 0x00, 0x0E};     ///< ptp4l: p2p_dst_mac
  /// The only peer, instead of multicast: nobody else is heard. Its port does not matter.
  std::optional<SocketAddress> unicast{};
  UnicastMessages unicast_messages = UnicastMessages::kAll;  ///< without `unicast`
};

/// Opens one of a port's two sockets: not blocking, bound, member of both groups. Over IEEE 802.3
/// both are packet sockets of ethertype 88-F7, and a filter leaves each its own messages.
[[nodiscard]] Result<Descriptor, OsError> open_endpoint(Kernel& kernel,
                                                        const PtpEndpointConfig& config,
                                                        const InterfaceState& interface,
                                                        Channel channel);

/// Where messages of a channel go: a group, or the configured peer instead.
[[nodiscard]] SocketAddress destination_of(const PtpEndpointConfig& config, int interface_index,
                                           Channel channel, Group group) noexcept;

/// Octets that follow each event message on the wire and mean nothing. UDP/IPv6 wants two (Annex
/// D): room for whoever corrects the message on its way to keep the checksum right.
[[nodiscard]] std::size_t padding_of(NetworkTransport transport) noexcept;

/// An address of the transport's kind, as a user writes it. None if it is not one.
[[nodiscard]] std::optional<SocketAddress> parse_peer(NetworkTransport transport,
                                                      const std::string& text);

}  // namespace ftcs::platform
