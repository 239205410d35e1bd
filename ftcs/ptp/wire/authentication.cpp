// SPDX-License-Identifier: MIT
#include "ftcs/ptp/wire/authentication.h"

#include "ftcs/ptp/wire/byte_order.h"
#include "ftcs/ptp/wire/message.h"

namespace ftcs::ptp {
namespace {

constexpr std::uint16_t kAuthenticationType = 0x8009;  // Table 52
constexpr std::size_t kLengthOffset = 2;
constexpr std::size_t kTlvHeaderSize = 4;

std::uint16_t read16(std::span<const std::uint8_t> message, std::size_t offset) noexcept {
  return ByteReader(message.subspan(offset)).read<std::uint16_t>();
}

}  // namespace

Result<AuthenticationTlv, AuthenticationFault> find_authentication(
    std::span<const std::uint8_t> message) noexcept {
  if (message.empty()) return AuthenticationFault::kMissing;
  std::size_t offset = size_of(static_cast<MessageType>(message[0] & 0xFU));
  if (offset == 0 || offset > message.size()) return AuthenticationFault::kMissing;
  const std::size_t end = read16(message, kLengthOffset);
  if (end > message.size() || offset > end) return AuthenticationFault::kMissing;
  // The decoder has checked each length; the conditions repeat what keeps this inside.
  std::size_t last = end;
  while (end - offset >= kTlvHeaderSize) {
    last = offset;
    offset += kTlvHeaderSize + read16(message, offset + kLengthOffset);
    if (offset > end) return AuthenticationFault::kMissing;
  }
  if (last == end || read16(message, last) != kAuthenticationType) {
    return AuthenticationFault::kMissing;
  }
  if (offset != end || end - last <= kAuthenticationHeaderSize) {
    return AuthenticationFault::kUnsupported;
  }
  ByteReader reader(message.subspan(last + kTlvHeaderSize));
  AuthenticationTlv tlv;
  tlv.spp = reader.read<std::uint8_t>();
  const auto indicator = reader.read<std::uint8_t>();  // secParamIndicator: what else is there
  tlv.key_id = reader.read<std::uint32_t>();
  tlv.covered = last + kAuthenticationHeaderSize;
  tlv.code_octets = end - tlv.covered;
  if (indicator != 0 || tlv.code_octets > kMaximumCodeSize) {
    return AuthenticationFault::kUnsupported;
  }
  return tlv;
}

void write_authentication(std::span<std::uint8_t> message, std::size_t length, std::uint8_t spp,
                          std::uint32_t key_id, std::size_t code_size) noexcept {
  ByteWriter(message.subspan(kLengthOffset))
      .write<2>(length + kAuthenticationHeaderSize + code_size);
  ByteWriter writer(message.subspan(length));
  writer.write<2>(kAuthenticationType);
  writer.write<2>(kAuthenticationHeaderSize - kTlvHeaderSize + code_size);
  writer.write<1>(spp);
  writer.write<1>(0);
  writer.write<4>(key_id);
}

}  // namespace ftcs::ptp
