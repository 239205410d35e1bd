// SPDX-License-Identifier: MIT
#include "ftcs/ptp/wire/monitor.h"

#include <optional>

#include "ftcs/ptp/wire/byte_order.h"
#include "ftcs/ptp/wire/fields.h"

namespace ftcs::ptp {
namespace {

constexpr std::size_t kBodySize = size_of(MessageType::kSignaling);
constexpr std::size_t kLengthOffset = 2;
constexpr std::size_t kTlvHeaderSize = 4;
constexpr std::size_t kIdentitySize = 10;
constexpr std::size_t kTimestampSize = 10;
constexpr std::uint16_t kSyncTiming = 0x8004;
constexpr std::uint16_t kDelayTiming = 0x7F00;
// sequenceId, timestamp, totalCorrectionField, (scaledCumulativeRateOffset,) timestamp.
constexpr std::size_t kDelayElement = 2 + kTimestampSize + 8 + kTimestampSize;
constexpr std::size_t kSyncElement = kDelayElement + 4;

std::optional<ReferenceTime> read_timestamp(ByteReader& reader) noexcept {
  const auto seconds = reader.read<std::uint64_t, 6>();
  const auto nanoseconds = reader.read<std::uint32_t>();
  return from_wire({seconds, nanoseconds});
}

/// False: a timestamp that is none.
bool read_sync(ByteReader& reader, MonitorSample& sample) noexcept {
  sample.direction = Direction::kForward;
  sample.sequence_id = reader.read<std::uint16_t>();
  const auto origin = read_timestamp(reader);
  const auto correction = Duration::from_scaled_ns(reader.read<std::int64_t>());
  reader.skip(4);  // scaledCumulativeRateOffset: of IEEE 802.1AS, and zero elsewhere
  const auto ingress = read_timestamp(reader);
  if (!origin || !ingress) return false;
  sample.reference = *origin + correction;
  sample.local_ns = ingress->since_epoch().floor_ns();
  return true;
}

bool read_delay(ByteReader& reader, MonitorSample& sample) noexcept {
  sample.direction = Direction::kBackward;
  sample.sequence_id = reader.read<std::uint16_t>();
  const auto origin = read_timestamp(reader);
  const auto correction = Duration::from_scaled_ns(reader.read<std::int64_t>());
  const auto response = read_timestamp(reader);
  if (!origin || !response) return false;
  sample.reference = *response - correction;
  sample.local_ns = origin->since_epoch().floor_ns();
  return true;
}

/// Reads one TLV of either kind behind its header; `offset` is where its value begins.
std::optional<DecodeError> read_value(std::span<const std::uint8_t> value, bool sync,
                                      std::size_t offset, MonitorReport& report) noexcept {
  const std::size_t element = sync ? kSyncElement : kDelayElement;
  const bool whole = value.size() > kIdentitySize && (value.size() - kIdentitySize) % element == 0;
  if (!whole) {
    return DecodeError{DecodeReason::kMalformedTlv, kIdentitySize + element, value.size(),
                       offset - 2};
  }
  ByteReader reader(value);
  PortIdentity transmitter{{reader.read_octets<8>()}};
  transmitter.port = reader.read<std::uint16_t>();
  while (reader.offset() < value.size()) {
    const std::size_t start = reader.offset();
    MonitorSample sample;
    sample.transmitter = transmitter;
    const bool good = sync ? read_sync(reader, sample) : read_delay(reader, sample);
    if (!good) return DecodeError{DecodeReason::kBadTimestamp, 1, 0, offset + start};
    if (report.size == MonitorReport::kCapacity) {
      return DecodeError{DecodeReason::kOversized, MonitorReport::kCapacity, report.size + 1U,
                         offset + start};
    }
    report.samples[report.size++] = sample;
  }
  return std::nullopt;
}

}  // namespace

Result<MonitorReport, DecodeError> decode_monitor(std::span<const std::uint8_t> bytes) noexcept {
  const auto message = decode(bytes);
  if (!message) return message.error();
  if (type_of(message->body) != MessageType::kSignaling) {
    return DecodeError{DecodeReason::kUnknownType,
                       static_cast<std::uint64_t>(MessageType::kSignaling),
                       static_cast<std::uint64_t>(type_of(message->body)), 0};
  }
  // decode() has seen that messageLength and every TLV lie inside.
  const std::size_t length = ByteReader(bytes.subspan(kLengthOffset)).read<std::uint16_t>();
  MonitorReport report;
  report.receiver = message->header.source;
  std::size_t offset = kBodySize;
  while (length - offset >= kTlvHeaderSize) {
    ByteReader reader(bytes.subspan(offset, kTlvHeaderSize));
    const auto type = reader.read<std::uint16_t>();
    const std::size_t size = reader.read<std::uint16_t>();
    offset += kTlvHeaderSize;
    if (type == kSyncTiming || type == kDelayTiming) {
      const auto error =
          read_value(bytes.subspan(offset, size), type == kSyncTiming, offset, report);
      if (error) return *error;
    } else {
      ++report.unknown_tlvs;
    }
    offset += size;
  }
  return report;
}

}  // namespace ftcs::ptp
