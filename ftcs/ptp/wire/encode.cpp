// SPDX-License-Identifier: MIT
#include "ftcs/ptp/wire/byte_order.h"
#include "ftcs/ptp/wire/codec.h"
#include "ftcs/ptp/wire/fields.h"
#include "ftcs/time/visit.h"

namespace ftcs::ptp {
namespace {

/// Writes fields; remembers whether a timestamp could not be written.
class FieldWriter {
 public:
  explicit FieldWriter(std::span<std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  template <std::size_t kOctets>
  void integer(std::uint64_t value) noexcept {
    bytes_.write<kOctets>(value);
  }
  void timestamp(ReferenceTime time) noexcept {
    const auto wire = to_wire(time);
    in_range_ = in_range_ && wire.has_value();
    bytes_.write<6>(wire ? wire->seconds : 0);
    bytes_.write<4>(wire ? wire->nanoseconds : 0);
  }
  void identity(const ClockIdentity& clock) noexcept {
    for (const auto octet : clock.octets) bytes_.write<1>(octet);
  }
  void identity(const PortIdentity& port) noexcept {
    identity(port.clock);
    bytes_.write<2>(port.port);
  }
  [[nodiscard]] bool in_range() const noexcept { return in_range_; }

 private:
  ByteWriter bytes_;
  bool in_range_ = true;
};

/// PATH_TRACE, 16.2, Table 119: one identity.
constexpr std::uint16_t kPathTraceType = 0x0008;
constexpr std::size_t kPathTraceSize = 8;
/// IEEE 802.1AS-2020, 11.4.4.3: ORGANIZATION_EXTENSION with 802.1's identifier and subtype 1.
constexpr std::uint16_t kOrganizationExtension = 0x0003;
constexpr std::size_t kFollowUpInformationSize = 28;
constexpr std::uint64_t kFollowUpInformationId = 0x0080C2'000001;
constexpr std::size_t kTlvHeaderSize = 4;

/// Octets of the TLVs that this message is sent with.
std::size_t tlv_size(const Body& body) noexcept {
  if (const auto* announce = std::get_if<Announce>(&body)) {
    return announce->path_trace ? kTlvHeaderSize + kPathTraceSize : 0;
  }
  if (const auto* follow_up = std::get_if<FollowUp>(&body)) {
    return follow_up->has_information ? kTlvHeaderSize + kFollowUpInformationSize : 0;
  }
  return 0;
}

/// controlField, 13.3.2.13, Table 42: kept for hardware that knows version 1.
std::uint8_t control_field(MessageType type) noexcept {
  switch (type) {
    case MessageType::kSync:
      return 0;
    case MessageType::kDelayReq:
      return 1;
    case MessageType::kFollowUp:
      return 2;
    case MessageType::kDelayResp:
      return 3;
    case MessageType::kManagement:
      return 4;
    default:
      return 5;
  }
}

/// Table 35.
void write_header(const Header& header, MessageType type, std::size_t size, std::int64_t correction,
                  FieldWriter& writer) noexcept {
  const auto nibbles = [](std::uint8_t high, std::uint8_t low) {
    return static_cast<std::uint64_t>((high & 0xFU) << 4 | (low & 0xFU));
  };
  writer.integer<1>(nibbles(header.major_sdo_id, static_cast<std::uint8_t>(type)));
  writer.integer<1>(nibbles(header.minor_version, kVersion));
  writer.integer<2>(size);
  writer.integer<1>(header.domain);
  writer.integer<1>(header.minor_sdo_id);
  writer.integer<2>(header.flags);
  writer.integer<8>(static_cast<std::uint64_t>(correction));
  writer.integer<4>(0);  // messageTypeSpecific
  writer.identity(header.source);
  writer.integer<2>(header.sequence_id);
  writer.integer<1>(control_field(type));
  writer.integer<1>(static_cast<std::uint8_t>(header.log_interval));
}

/// One overload per body, in the order of Tables 43 to 50 and 56. Reserved octets stay zero.
struct BodyWriter {
  FieldWriter& writer;

  void operator()(const Sync& body) const noexcept { writer.timestamp(body.origin); }
  void operator()(const DelayReq& body) const noexcept { writer.timestamp(body.origin); }
  void operator()(const PdelayReq& body) const noexcept { writer.timestamp(body.origin); }
  void operator()(const FollowUp& body) const noexcept {
    writer.timestamp(body.precise_origin);
    if (body.has_information) write(body.information);
  }
  void operator()(const DelayResp& body) const noexcept {
    writer.timestamp(body.receive);
    writer.identity(body.requesting_port);
  }
  void operator()(const PdelayResp& body) const noexcept {
    writer.timestamp(body.request_receipt);
    writer.identity(body.requesting_port);
  }
  void operator()(const PdelayRespFollowUp& body) const noexcept {
    writer.timestamp(body.response_origin);
    writer.identity(body.requesting_port);
  }
  void operator()(const Announce& body) const noexcept {
    writer.timestamp(body.origin);
    writer.integer<2>(static_cast<std::uint16_t>(body.utc_offset));
    writer.integer<1>(0);
    writer.integer<1>(body.priority1);
    writer.integer<1>(body.quality.clock_class);
    writer.integer<1>(body.quality.clock_accuracy);
    writer.integer<2>(body.quality.offset_scaled_log_variance);
    writer.integer<1>(body.priority2);
    writer.identity(body.grandmaster);
    writer.integer<2>(body.steps_removed);
    writer.integer<1>(body.time_source);
    if (!body.path_trace) return;
    writer.integer<2>(kPathTraceType);
    writer.integer<2>(kPathTraceSize);
    writer.identity(body.grandmaster);
  }
  void operator()(const Signaling& body) const noexcept { writer.identity(body.target); }
  void operator()(const Management& body) const noexcept {
    writer.identity(body.target);
    writer.integer<1>(body.starting_boundary_hops);
    writer.integer<1>(body.boundary_hops);
    writer.integer<1>(body.action & 0xFU);
  }
  void write(const FollowUpInformation& information) const noexcept {
    writer.integer<2>(kOrganizationExtension);
    writer.integer<2>(kFollowUpInformationSize);
    writer.integer<6>(kFollowUpInformationId);
    writer.integer<4>(static_cast<std::uint32_t>(information.cumulative_scaled_rate_offset));
    writer.integer<2>(information.gm_time_base_indicator);
    const Duration phase = information.last_gm_phase_change;  // ScaledNs, 96 bits
    writer.integer<2>(phase < Duration{} ? 0xFFFF : 0);
    writer.integer<8>(static_cast<std::uint64_t>(phase.floor_ns()));
    writer.integer<2>(phase.fraction() >> 16);
    writer.integer<4>(static_cast<std::uint32_t>(information.scaled_last_gm_freq_change));
  }
};

}  // namespace

Result<MessageBytes, EncodeError> encode(const Message& message) noexcept {
  const auto correction = to_scaled_ns(message.header.correction);
  if (!correction) return EncodeError::kCorrectionOutOfRange;
  const MessageType type = type_of(message.body);
  MessageBytes bytes;
  bytes.size = static_cast<std::uint8_t>(size_of(type) + tlv_size(message.body));
  FieldWriter writer({bytes.octets.data(), bytes.size});
  write_header(message.header, type, bytes.size, *correction, writer);
  ftcs::visit(BodyWriter{writer}, message.body);
  if (!writer.in_range()) return EncodeError::kTimestampOutOfRange;
  return bytes;
}

}  // namespace ftcs::ptp
