// SPDX-License-Identifier: MIT
#include <optional>

#include "ftcs/ptp/wire/byte_order.h"
#include "ftcs/ptp/wire/codec.h"
#include "ftcs/ptp/wire/fields.h"

namespace ftcs::ptp {
namespace {

/// Table 35.
constexpr std::size_t kHeaderSize = 34;
constexpr std::size_t kVersionOffset = 1;
constexpr std::size_t kLengthOffset = 2;
/// 14.1: tlvType and lengthField stand before each value.
constexpr std::size_t kTlvHeaderSize = 4;

/// Reads fields and keeps the first field that is out of range.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  template <class Integer>
  Integer integer() noexcept {
    return bytes_.read<Integer>();
  }
  ReferenceTime timestamp() noexcept {
    const std::size_t offset = bytes_.offset();
    const auto seconds = bytes_.read<std::uint64_t, 6>();
    const auto nanoseconds = bytes_.read<std::uint32_t>();
    const auto time = from_wire({seconds, nanoseconds});
    if (time) return *time;
    if (!failed_) {
      failed_ = true;
      const bool bad_seconds = seconds > kMaximumSeconds;
      error_ = DecodeError{DecodeReason::kBadTimestamp,
                           bad_seconds ? kMaximumSeconds : kNanosecondsPerSecond - 1,
                           bad_seconds ? seconds : nanoseconds, bad_seconds ? offset : offset + 6};
    }
    return {};
  }
  ClockIdentity clock_identity() noexcept { return {bytes_.read_octets<8>()}; }
  PortIdentity port_identity() noexcept {
    PortIdentity identity{clock_identity()};
    identity.port = bytes_.read<std::uint16_t>();
    return identity;
  }
  void skip(std::size_t octets) noexcept { bytes_.skip(octets); }
  [[nodiscard]] bool failed() const noexcept { return failed_; }
  [[nodiscard]] const DecodeError& error() const noexcept { return error_; }

 private:
  ByteReader bytes_;
  // Not std::optional: gcc 12 warns of uninitialised reads that cannot happen.
  bool failed_ = false;
  DecodeError error_;
};

/// IEEE 802.1AS-2020, 11.4.4.3: ORGANIZATION_EXTENSION with 802.1's identifier and subtype 1.
constexpr std::uint16_t kOrganizationExtension = 0x0003;
constexpr std::size_t kFollowUpInformationSize = 28;
constexpr std::uint64_t kFollowUpInformationId = 0x0080C2'000001;

std::optional<MessageType> known_type(std::uint8_t nibble) noexcept {
  if (nibble <= 0x3 || (nibble >= 0x8 && nibble <= 0xD)) return static_cast<MessageType>(nibble);
  return std::nullopt;
}

/// Fields of Table 35 in their order; the first four octets have been checked already.
Header read_header(FieldReader& reader) noexcept {
  Header header;
  header.major_sdo_id = static_cast<std::uint8_t>(reader.integer<std::uint8_t>() >> 4);
  header.minor_version = static_cast<std::uint8_t>(reader.integer<std::uint8_t>() >> 4);
  reader.skip(2);  // messageLength
  header.domain = reader.integer<std::uint8_t>();
  header.minor_sdo_id = reader.integer<std::uint8_t>();
  header.flags = reader.integer<std::uint16_t>();
  header.correction = Duration::from_scaled_ns(reader.integer<std::int64_t>());
  reader.skip(4);  // messageTypeSpecific
  header.source = reader.port_identity();
  header.sequence_id = reader.integer<std::uint16_t>();
  reader.skip(1);  // controlField: ignored on receipt (13.3.2.13)
  header.log_interval = reader.integer<std::int8_t>();
  return header;
}

/// Table 43.
Announce read_announce(FieldReader& reader) noexcept {
  Announce announce;
  announce.origin = reader.timestamp();
  announce.utc_offset = reader.integer<std::int16_t>();
  reader.skip(1);
  announce.priority1 = reader.integer<std::uint8_t>();
  announce.quality.clock_class = reader.integer<std::uint8_t>();
  announce.quality.clock_accuracy = reader.integer<std::uint8_t>();
  announce.quality.offset_scaled_log_variance = reader.integer<std::uint16_t>();
  announce.priority2 = reader.integer<std::uint8_t>();
  announce.grandmaster = reader.clock_identity();
  announce.steps_removed = reader.integer<std::uint16_t>();
  announce.time_source = reader.integer<std::uint8_t>();
  return announce;
}

/// Table 56.
Management read_management(FieldReader& reader) noexcept {
  Management management;
  management.target = reader.port_identity();
  management.starting_boundary_hops = reader.integer<std::uint8_t>();
  management.boundary_hops = reader.integer<std::uint8_t>();
  management.action = static_cast<std::uint8_t>(reader.integer<std::uint8_t>() & 0xFU);
  return management;
}

template <class TimeAndPort>
TimeAndPort read_time_and_port(FieldReader& reader) noexcept {
  TimeAndPort body{reader.timestamp(), {}};
  body.requesting_port = reader.port_identity();
  return body;
}

Body read_body(MessageType type, FieldReader& reader) noexcept {
  switch (type) {
    case MessageType::kSync:
      return Sync{reader.timestamp()};
    case MessageType::kDelayReq:
      return DelayReq{reader.timestamp()};
    case MessageType::kPdelayReq:
      return PdelayReq{reader.timestamp()};
    case MessageType::kPdelayResp:
      return read_time_and_port<PdelayResp>(reader);
    case MessageType::kFollowUp:
      return FollowUp{reader.timestamp()};
    case MessageType::kDelayResp:
      return read_time_and_port<DelayResp>(reader);
    case MessageType::kPdelayRespFollowUp:
      return read_time_and_port<PdelayRespFollowUp>(reader);
    case MessageType::kAnnounce:
      return read_announce(reader);
    case MessageType::kSignaling:
      return Signaling{reader.port_identity()};
    case MessageType::kManagement:
      return read_management(reader);
  }
  return Sync{};
}

/// ScaledNs, 802.1AS-2020, 6.4.3.1: 96 bits in units of 2^-16 ns. What a Duration cannot hold
/// becomes the largest one that the encoder writes the same.
Duration read_scaled_ns(ByteReader& reader) noexcept {
  constexpr std::int64_t kLargest = std::int64_t{1} << 62;
  const auto high = reader.read<std::int16_t>();
  const auto ns = reader.read<std::int64_t>();
  const auto fraction = reader.read<std::uint16_t>();
  const bool fits = high == (ns < 0 ? -1 : 0) && ns < kLargest && ns >= -kLargest;
  if (!fits) return Duration::from_whole_ns(high < 0 ? -kLargest : kLargest - 1);
  return Duration::from_parts(ns, static_cast<std::uint32_t>(fraction) << 16);
}

/// If this TLV is the Follow_Up information, it is read. Of several the last one counts.
void read_follow_up_information(std::span<const std::uint8_t> tlv, FollowUp& body) noexcept {
  ByteReader reader(tlv);
  const auto type = reader.read<std::uint16_t>();
  if (type != kOrganizationExtension || tlv.size() != kTlvHeaderSize + kFollowUpInformationSize) {
    return;
  }
  reader.skip(2);
  if (reader.read<std::uint64_t, 6>() != kFollowUpInformationId) return;
  body.has_information = true;
  FollowUpInformation& information = body.information;
  information.cumulative_scaled_rate_offset = reader.read<std::int32_t>();
  information.gm_time_base_indicator = reader.read<std::uint16_t>();
  information.last_gm_phase_change = read_scaled_ns(reader);
  information.scaled_last_gm_freq_change = reader.read<std::int32_t>();
}

/// 14.1: each TLV has an even length and ends inside the message. Fewer than four octets at the end
/// are no TLV; they are left alone, as padding of old transmitters.
std::optional<DecodeError> read_tlvs(std::span<const std::uint8_t> message, std::size_t offset,
                                     Body& body) noexcept {
  auto* const follow_up = std::get_if<FollowUp>(&body);
  while (message.size() - offset >= kTlvHeaderSize) {
    ByteReader reader(message.subspan(offset + 2, 2));
    const std::size_t length = reader.read<std::uint16_t>();
    const std::size_t room = message.size() - offset - kTlvHeaderSize;
    if (length > room) return DecodeError{DecodeReason::kMalformedTlv, room, length, offset + 2};
    if (length % 2 != 0) {
      return DecodeError{DecodeReason::kMalformedTlv, length - 1, length, offset + 2};
    }
    if (follow_up != nullptr) {
      read_follow_up_information(message.subspan(offset, kTlvHeaderSize + length), *follow_up);
    }
    offset += kTlvHeaderSize + length;
  }
  return std::nullopt;
}

struct Frame {
  MessageType type = MessageType::kSync;
  std::span<const std::uint8_t> message;
};

/// Everything that must hold before a field is read.
Result<Frame, DecodeError> check_frame(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() > kMaximumMessageSize) {
    return DecodeError{DecodeReason::kOversized, kMaximumMessageSize, bytes.size(), 0};
  }
  if (bytes.size() < kHeaderSize) {
    return DecodeError{DecodeReason::kTruncated, kHeaderSize, bytes.size(), bytes.size()};
  }
  const auto version = static_cast<std::uint8_t>(bytes[kVersionOffset] & 0xFU);
  if (version != kVersion) {
    return DecodeError{DecodeReason::kWrongVersion, kVersion, version, kVersionOffset};
  }
  const auto nibble = static_cast<std::uint8_t>(bytes[0] & 0xFU);
  const auto type = known_type(nibble);
  if (!type) {
    const auto last = static_cast<std::uint64_t>(MessageType::kManagement);
    return DecodeError{DecodeReason::kUnknownType, last, nibble, 0};
  }
  const std::size_t length = ByteReader(bytes.subspan(kLengthOffset)).read<std::uint16_t>();
  if (length < size_of(*type)) {
    return DecodeError{DecodeReason::kWrongLength, size_of(*type), length, kLengthOffset};
  }
  if (length > bytes.size()) {
    return DecodeError{DecodeReason::kTruncated, length, bytes.size(), bytes.size()};
  }
  return Frame{*type, bytes.first(length)};
}

}  // namespace

Result<Message, DecodeError> decode(std::span<const std::uint8_t> bytes) noexcept {
  const auto frame = check_frame(bytes);
  if (!frame) return frame.error();
  FieldReader reader(frame->message);
  const Header header = read_header(reader);
  Message message{header, read_body(frame->type, reader)};
  if (reader.failed()) return reader.error();
  if (const auto error = read_tlvs(frame->message, size_of(frame->type), message.body)) {
    return *error;
  }
  return message;
}

EventId event_id(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::size_t kSequenceId = 30;
  constexpr std::size_t kRequestingPort = 44;
  EventId id;
  if (bytes.size() < kHeaderSize) return id;
  id.type = static_cast<MessageType>(bytes[0] & 0xFU);
  id.sequence_id = ByteReader(bytes.subspan(kSequenceId)).read<std::uint16_t>();
  if (id.type == MessageType::kPdelayResp && bytes.size() >= size_of(id.type)) {
    id.requester = FieldReader(bytes.subspan(kRequestingPort)).port_identity();
  }
  return id;
}

std::string_view to_string(DecodeReason reason) noexcept {
  constexpr std::string_view kNames[kDecodeReasons] = {
      "truncated",    "oversized",     "wrong_version", "unknown_type",
      "wrong_length", "bad_timestamp", "malformed_tlv"};
  return kNames[static_cast<std::size_t>(reason)];
}

}  // namespace ftcs::ptp
