// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "ftcs/ptp/wire/message.h"
#include "ftcs/time/result.h"

namespace ftcs::ptp {

/// Why bytes are no PTP message that we understand.
enum class DecodeReason : std::uint8_t {
  kTruncated,     ///< fewer bytes than the header, the fixed part or messageLength needs
  kOversized,     ///< more bytes than an Ethernet frame can carry
  kWrongVersion,  ///< versionPTP is not 2
  kUnknownType,   ///< a messageType that 13.3.2.3 reserves
  kWrongLength,   ///< messageLength is smaller than the fixed part of its type
  kBadTimestamp,  ///< nanoseconds of 10^9 or more (5.3.3), or seconds beyond 64-bit nanoseconds
                  ///< (year 2262)
  kMalformedTlv,  ///< a TLV of odd length, or one that ends behind the message (14.1)
};
inline constexpr std::size_t kDecodeReasons = 7;

/// "truncated": the enumerator's words in lower case.
[[nodiscard]] std::string_view to_string(DecodeReason reason) noexcept;

/// What was expected at which octet, and what stood there.
struct DecodeError {
  DecodeReason reason = DecodeReason::kTruncated;
  std::uint64_t expected = 0;
  std::uint64_t received = 0;
  std::size_t offset = 0;
};

/// UDP payload of a full Ethernet frame: 1500 - 20 (IPv4) - 8 (UDP). No message we understand is
/// longer.
inline constexpr std::size_t kMaximumMessageSize = 1472;

/// Bytes to message. Octets behind messageLength are padding and ignored (Annexes C to E); TLVs
/// inside are checked and skipped (14.1). The result never refers to the bytes. Any octets are
/// borne, whoever sent them.
///
///     const auto message = decode(octets);
///     if (!message) return to_string(message.error().reason);
///     if (const auto* sync = std::get_if<Sync>(&message->body)) use(sync->origin);
[[nodiscard]] Result<Message, DecodeError> decode(std::span<const std::uint8_t> bytes) noexcept;

/// An encoded message; Announce with a path trace of one and Follow_Up with its information, the
/// longest ones, fit, and an AUTHENTICATION TLV behind them.
struct MessageBytes {
  std::array<std::uint8_t, 118> octets{};
  std::uint8_t size = 0;
  [[nodiscard]] constexpr std::span<const std::uint8_t> view() const noexcept {
    return {octets.data(), size};
  }
};

/// Why a message cannot be written.
enum class EncodeError : std::uint8_t {
  kTimestampOutOfRange,   ///< before the epoch: seconds are unsigned on the wire
  kCorrectionOutOfRange,  ///< beyond ±2^47 ns
};

/// Message to bytes. A timestamp's fraction of a nanosecond is cut off: put it into the correction
/// first.
[[nodiscard]] Result<MessageBytes, EncodeError> encode(const Message& message) noexcept;

/// Which event message a transmit stamp belongs to. Sequence ids are counted for each type, and for
/// answers by the requester.
struct EventId {
  MessageType type = MessageType::kSync;
  std::uint16_t sequence_id = 0;
  PortIdentity requester{};  ///< of a Pdelay_Resp; else zero
  friend constexpr bool operator==(const EventId&, const EventId&) noexcept = default;
};

/// The id of an event message that encode() wrote, read from its octets. Octets that are no message
/// give an id that nobody waits for.
[[nodiscard]] EventId event_id(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace ftcs::ptp
