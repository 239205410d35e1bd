// SPDX-License-Identifier: MIT
#include "ftcs/diagnosis/talkers.h"

#include <algorithm>

namespace ftcs::diagnosis {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint16_t kVlanTag = 0x8100;          // IEEE 802.1Q
constexpr std::uint16_t kServiceTag = 0x88A8;       // IEEE 802.1ad
constexpr std::uint16_t kPtpOverEthernet = 0x88F7;  // Annex E
constexpr std::uint16_t kIpv4 = 0x0800;
constexpr std::uint16_t kIpv6 = 0x86DD;
constexpr std::uint8_t kUdp = 17;
constexpr std::uint16_t kEventPort = 319;
constexpr std::uint16_t kGeneralPort = 320;
constexpr std::size_t kUdpHeader = 8;
// 13.3.1, Table 35 and 13.5.1, Table 43.
constexpr std::size_t kHeader = 34;
constexpr std::size_t kIdentityAt = 20;
constexpr std::size_t kUtcOffsetAt = 44;

std::uint16_t word(Bytes bytes, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

/// Of the Timestamp behind the header (5.3.3): 48 bits of seconds.
std::optional<std::int64_t> seconds_of(Bytes message) noexcept {
  constexpr std::size_t kSize = 6;
  if (message.size() < kHeader + kSize) return std::nullopt;
  std::int64_t seconds = 0;
  for (std::size_t i = 0; i < kSize; ++i) seconds = seconds << 8 | message[kHeader + i];
  return seconds;
}

/// What UDP carries, if it is for PTP's ports.
Bytes ptp_of_udp(Bytes datagram) noexcept {
  if (datagram.size() < kUdpHeader) return {};
  const std::uint16_t port = word(datagram, 2);
  if (port != kEventPort && port != kGeneralPort) return {};
  return datagram.subspan(kUdpHeader);
}

Bytes ptp_of_ipv4(Bytes packet) noexcept {
  constexpr std::size_t kShortest = 20;
  if (packet.size() < kShortest || packet[9] != kUdp) return {};
  const std::size_t header = std::size_t{4} * (packet[0] & 0x0FU);
  if (header < kShortest || packet.size() < header) return {};
  return ptp_of_udp(packet.subspan(header));
}

Bytes ptp_of_ipv6(Bytes packet) noexcept {
  constexpr std::size_t kIpv6Header = 40;
  if (packet.size() < kIpv6Header || packet[6] != kUdp) return {};
  return ptp_of_udp(packet.subspan(kIpv6Header));
}

}  // namespace

void Talkers::on_message(Bytes message, Way way) noexcept {
  Talker kind;
  kind.way = way;
  note(message, kind);
}

void Talkers::on_frame(Bytes frame) noexcept {
  constexpr std::size_t kAddresses = 12;
  constexpr std::size_t kTag = 4;
  if (frame.size() < kAddresses + 2) return;
  Talker kind;
  std::copy_n(frame.begin(), kind.destination.size(), kind.destination.begin());
  kind.to_group = (kind.destination[0] & 1U) != 0;
  std::size_t at = kAddresses;
  std::uint16_t type = word(frame, at);
  while ((type == kVlanTag || type == kServiceTag) && frame.size() >= at + kTag + 2) {
    kind.vlan = word(frame, at + 2) & 0x0FFFU;
    at += kTag;
    type = word(frame, at);
  }
  const Bytes payload = frame.subspan(at + 2);
  if (type == kPtpOverEthernet) {
    kind.way = Way::kEthernet;
    note(payload, kind);
  } else if (type == kIpv4) {
    kind.way = Way::kUdpIpv4;
    note(ptp_of_ipv4(payload), kind);
  } else if (type == kIpv6) {
    kind.way = Way::kUdpIpv6;
    note(ptp_of_ipv6(payload), kind);
  }
}

void Talkers::note(Bytes message, Talker kind) noexcept {
  if (message.size() < kHeader) return;
  kind.version = message[1] & 0x0FU;
  const std::size_t type = message[0] & 0x0FU;
  if (kind.version == ptp::kVersion) {
    kind.major_sdo_id = message[0] >> 4;
    kind.domain = message[4];
    std::copy_n(message.begin() + kIdentityAt, kind.port.clock.octets.size(),
                kind.port.clock.octets.begin());
    kind.port.port = word(message, kIdentityAt + kind.port.clock.octets.size());
    if (own_ == kind.port.clock) return;
  }
  Talker* const talker = entry(kind);
  if (talker == nullptr) return;
  ++talker->messages[type];
  const std::uint16_t flags = word(message, 6);
  switch (static_cast<ptp::MessageType>(type)) {
    case ptp::MessageType::kSync:
      talker->two_step = (flags & ptp::flag::kTwoStep) != 0;
      if (!talker->two_step) talker->shown_s = seconds_of(message);
      break;
    case ptp::MessageType::kFollowUp:
      talker->shown_s = seconds_of(message);
      break;
    case ptp::MessageType::kAnnounce:
      talker->announce_flags = flags;
      if (message.size() >= kUtcOffsetAt + 2) {
        talker->utc_offset = static_cast<std::int16_t>(word(message, kUtcOffsetAt));
      }
      break;
    default:
      break;
  }
}

Talker* Talkers::entry(const Talker& kind) noexcept {
  for (std::size_t i = 0; i < size_; ++i) {
    Talker& known = talkers_[i];
    if (known.way == kind.way && known.vlan == kind.vlan && known.version == kind.version &&
        known.domain == kind.domain && known.major_sdo_id == kind.major_sdo_id &&
        known.to_group == kind.to_group && known.destination == kind.destination &&
        known.port == kind.port) {
      return &known;
    }
  }
  if (size_ == kCapacity) return nullptr;
  talkers_[size_] = kind;
  return &talkers_[size_++];
}

}  // namespace ftcs::diagnosis
