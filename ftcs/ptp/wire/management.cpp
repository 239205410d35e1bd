// SPDX-License-Identifier: MIT
#include "ftcs/ptp/wire/management.h"

#include <algorithm>

#include "ftcs/ptp/wire/byte_order.h"
#include "ftcs/ptp/wire/fields.h"
#include "ftcs/time/visit.h"

namespace ftcs::ptp {
namespace {

constexpr std::size_t kBodySize = size_of(MessageType::kManagement);
constexpr std::size_t kLengthOffset = 2;  // messageLength in the common header
constexpr std::size_t kTlvHeaderSize = 4;
constexpr std::uint16_t kManagementTlv = 0x0001;
constexpr std::uint16_t kErrorTlv = 0x0002;
constexpr std::size_t kErrorValueSize = 8;  // managementErrorId, managementId, four reserved octets
constexpr std::uint64_t kGreatestInterval = (std::uint64_t{1} << 63) - 1;

/// Fields of a TLV, out of bytes.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) noexcept
      : bytes_(bytes), size_(bytes.size()) {}

  template <class Integer>
  void integer(Integer& value) noexcept {
    value = bytes_.read<Integer>();
  }
  template <std::size_t kOctets>
  void octets(std::array<std::uint8_t, kOctets>& value) noexcept {
    value = bytes_.read_octets<kOctets>();
  }
  void state(PortState& value) noexcept {
    value = static_cast<PortState>(bytes_.read<std::uint8_t>());
  }
  void interval(Duration& value) noexcept {
    value = Duration::from_scaled_ns(bytes_.read<std::int64_t>());
  }
  void little_endian(std::uint64_t& value) noexcept {
    value = 0;
    const auto octets = bytes_.read_octets<sizeof value>();
    for (std::size_t i = octets.size(); i-- > 0;) value = value << 8 | octets[i];
  }
  template <std::size_t kCapacity>
  void text(PtpText<kCapacity>& value) noexcept {
    const std::size_t size = bytes_.read<std::uint8_t>();
    if (!take(size, kCapacity)) return;
    value.size = static_cast<std::uint8_t>(size);
    for (std::size_t i = 0; i < size; ++i) {
      value.characters[i] = static_cast<char>(bytes_.read<std::uint8_t>());
    }
  }
  void address(AddressOctets& value) noexcept {
    const std::size_t size = bytes_.read<std::uint16_t>();
    if (!take(size, value.octets.size())) return;
    value.size = static_cast<std::uint16_t>(size);
    for (std::size_t i = 0; i < size; ++i) value.octets[i] = bytes_.read<std::uint8_t>();
  }
  void reserved(std::size_t octets) noexcept { bytes_.skip(octets); }
  /// All fields, and nothing behind them but one octet that makes the length even.
  [[nodiscard]] bool complete() const noexcept {
    return fits_ && bytes_.offset() <= size_ && size_ - bytes_.offset() <= 1;
  }

 private:
  bool take(std::size_t size, std::size_t capacity) noexcept {
    fits_ =
        fits_ && size <= capacity && bytes_.offset() <= size_ && size <= size_ - bytes_.offset();
    return fits_;
  }

  ByteReader bytes_;
  std::size_t size_;
  bool fits_ = true;
};

/// The same fields into bytes.
class Writer {
 public:
  explicit Writer(std::span<std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  template <class Integer>
  void integer(const Integer& value) noexcept {
    write<sizeof(Integer)>(static_cast<std::uint64_t>(value));
  }
  template <std::size_t kOctets>
  void octets(const std::array<std::uint8_t, kOctets>& value) noexcept {
    for (const auto octet : value) write<1>(octet);
  }
  void state(PortState value) noexcept { write<1>(static_cast<std::uint8_t>(value)); }
  void interval(Duration value) noexcept {
    const auto scaled = to_scaled_ns(value);
    const std::uint64_t beyond =
        value < Duration{} ? ~kGreatestInterval : kGreatestInterval;  // 8.2.2.3
    write<8>(scaled ? static_cast<std::uint64_t>(*scaled) : beyond);
  }
  void little_endian(std::uint64_t value) noexcept {
    for (std::size_t i = 0; i < sizeof value; ++i) write<1>(value >> (8 * i) & 0xFFU);
  }
  template <std::size_t kCapacity>
  void text(const PtpText<kCapacity>& value) noexcept {
    write<1>(value.size);
    for (const char character : value.view()) write<1>(static_cast<std::uint8_t>(character));
  }
  void address(const AddressOctets& value) noexcept {
    write<2>(value.size);
    for (std::size_t i = 0; i < value.size; ++i) write<1>(value.octets[i]);
  }
  void reserved(std::size_t octets) noexcept {
    for (std::size_t i = 0; i < octets; ++i) write<1>(0);
  }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

 private:
  template <std::size_t kOctets>
  void write(std::uint64_t value) noexcept {
    bytes_.write<kOctets>(value);
    size_ += kOctets;
  }

  ByteWriter bytes_;
  std::size_t size_ = 0;
};

// One list of fields for both ways. Stream: Reader with values, or Writer with constant ones.
template <class Stream, class Identity>
void clock(Stream& stream, Identity& identity) noexcept {
  stream.octets(identity.octets);
}
template <class Stream, class Identity>
void port(Stream& stream, Identity& identity) noexcept {
  clock(stream, identity.clock);
  stream.integer(identity.port);
}
template <class Stream, class Quality>
void quality(Stream& stream, Quality& value) noexcept {
  stream.integer(value.clock_class);
  stream.integer(value.clock_accuracy);
  stream.integer(value.offset_scaled_log_variance);
}

/// Data or const Data, whichever the stream needs.
template <class Data, class Expected>
concept DataOf = std::is_same_v<std::remove_const_t<Data>, Expected>;

template <class Stream, DataOf<NullManagement> Data>
void fields(Stream&, Data&) noexcept {}

template <class Stream, DataOf<ClockDescription> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.clock_type);
  stream.text(data.physical_layer);
  stream.address(data.physical_address);
  stream.integer(data.network_protocol);
  stream.address(data.protocol_address);
  stream.octets(data.manufacturer);
  stream.reserved(1);
  stream.text(data.product);
  stream.text(data.revision);
  stream.text(data.user);
  stream.octets(data.profile);
}

template <class Stream, DataOf<UserDescription> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.text(data.text);
}

template <class Stream, DataOf<DefaultDataSet> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.flags);
  stream.reserved(1);
  stream.integer(data.ports);
  stream.integer(data.priority1);
  quality(stream, data.quality);
  stream.integer(data.priority2);
  clock(stream, data.identity);
  stream.integer(data.domain);
  stream.reserved(1);
}

template <class Stream, DataOf<CurrentDataSet> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.steps_removed);
  stream.interval(data.offset);
  stream.interval(data.mean_path_delay);
}

template <class Stream, DataOf<ParentDataSet> Data>
void fields(Stream& stream, Data& data) noexcept {
  port(stream, data.parent);
  stream.integer(data.statistics);
  stream.reserved(1);
  stream.integer(data.observed_variance);
  stream.integer(data.observed_phase_change_rate);
  stream.integer(data.grandmaster_priority1);
  quality(stream, data.grandmaster_quality);
  stream.integer(data.grandmaster_priority2);
  clock(stream, data.grandmaster);
}

template <class Stream, DataOf<TimePropertiesDataSet> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.utc_offset);
  stream.integer(data.flags);
  stream.integer(data.time_source);
}

template <class Stream, DataOf<PortDataSet> Data>
void fields(Stream& stream, Data& data) noexcept {
  port(stream, data.port);
  stream.state(data.state);
  stream.integer(data.log_min_delay_req_interval);
  stream.interval(data.mean_link_delay);
  stream.integer(data.log_announce_interval);
  stream.integer(data.announce_receipt_timeout);
  stream.integer(data.log_sync_interval);
  stream.integer(data.delay_mechanism);
  stream.integer(data.log_min_pdelay_req_interval);
  stream.integer(data.version);
}

template <class Stream, DataOf<Domain> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.domain);
  stream.reserved(1);
}

template <class Stream, DataOf<TimeStatusNp> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.offset_ns);
  stream.integer(data.ingress_ns);
  stream.integer(data.scaled_rate_offset);
  stream.integer(data.scaled_phase_change);
  stream.integer(data.time_base_indicator);
  stream.octets(data.last_phase_change);
  stream.integer(data.grandmaster_present);
  clock(stream, data.grandmaster);
}

template <class Stream, DataOf<PortDataSetNp> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.neighbour_delay_threshold_ns);
  stream.integer(data.as_capable);
}

template <class Stream, DataOf<PortPropertiesNp> Data>
void fields(Stream& stream, Data& data) noexcept {
  port(stream, data.port);
  stream.state(data.state);
  stream.integer(data.timestamping);
  stream.text(data.interface);
}

template <class Stream, DataOf<PortStatsNp> Data>
void fields(Stream& stream, Data& data) noexcept {
  port(stream, data.port);
  for (auto& count : data.received) stream.little_endian(count);
  for (auto& count : data.sent) stream.little_endian(count);
}

template <class Stream, DataOf<SubscribeEventsNp> Data>
void fields(Stream& stream, Data& data) noexcept {
  stream.integer(data.duration_s);
  stream.octets(data.events);
}

constexpr std::array kIds{ManagementId::kNullManagement,
                          ManagementId::kClockDescription,
                          ManagementId::kUserDescription,
                          ManagementId::kDefaultDataSet,
                          ManagementId::kCurrentDataSet,
                          ManagementId::kParentDataSet,
                          ManagementId::kTimePropertiesDataSet,
                          ManagementId::kPortDataSet,
                          ManagementId::kDomain,
                          ManagementId::kTimeStatusNp,
                          ManagementId::kPortDataSetNp,
                          ManagementId::kPortPropertiesNp,
                          ManagementId::kPortStatsNp,
                          ManagementId::kSubscribeEventsNp};
static_assert(kIds.size() == std::variant_size_v<ManagementData>);

template <std::size_t... kIndex>
std::optional<ManagementData> empty_data(ManagementId id, std::index_sequence<kIndex...>) noexcept {
  std::optional<ManagementData> data;
  static_cast<void>(
      ((kIds[kIndex] == id && (data.emplace(std::in_place_index<kIndex>), true)) || ...));
  return data;
}

/// Of requests data is read where it is the question: what a GET carries are dummies.
bool has_data(const ManagementMessage& message) noexcept {
  return message.action() == ManagementAction::kResponse ||
         (message.action() == ManagementAction::kSet &&
          message.id == ManagementId::kSubscribeEventsNp);
}

DecodeError bad_tlv(std::size_t expected, std::size_t received, std::size_t offset) noexcept {
  return {DecodeReason::kMalformedTlv, expected, received, offset};
}

/// Reads the value of a management TLV into `message`; false if it does not have its length.
bool read_data(std::span<const std::uint8_t> value, ManagementMessage& message) noexcept {
  message.data = empty_data(message.id, std::make_index_sequence<kIds.size()>{});
  if (!message.data) return true;  // of no concern to us
  Reader reader(value);
  ftcs::visit([&reader](auto& data) { fields(reader, data); }, *message.data);
  return reader.complete();
}

}  // namespace

ManagementId id_of(const ManagementData& data) noexcept { return kIds[data.index()]; }

Result<ManagementMessage, DecodeError> decode_management(
    std::span<const std::uint8_t> bytes) noexcept {
  const auto decoded = decode(bytes);
  if (!decoded) return decoded.error();
  const auto* const body = std::get_if<Management>(&decoded->body);
  if (body == nullptr) {
    return DecodeError{DecodeReason::kUnknownType,
                       static_cast<std::uint64_t>(MessageType::kManagement),
                       static_cast<std::uint64_t>(type_of(decoded->body)), 0};
  }
  // decode() has seen that messageLength and every TLV lie inside.
  const std::size_t length = ByteReader(bytes.subspan(kLengthOffset)).read<std::uint16_t>();
  const auto tlvs = bytes.first(length).subspan(kBodySize);
  if (tlvs.size() < kTlvHeaderSize + 2) {
    return bad_tlv(kTlvHeaderSize + 2, tlvs.size(), kBodySize);
  }
  ByteReader reader(tlvs);
  const auto type = reader.read<std::uint16_t>();
  const auto size = reader.read<std::uint16_t>();
  if (type != kManagementTlv && type != kErrorTlv) return bad_tlv(kManagementTlv, type, kBodySize);
  const std::size_t needed = type == kErrorTlv ? kErrorValueSize : 2;
  if (size < needed) return bad_tlv(needed, size, kBodySize + 2);
  ManagementMessage message{decoded->header, *body};
  if (type == kErrorTlv) message.error = static_cast<ManagementError>(reader.read<std::uint16_t>());
  message.id = static_cast<ManagementId>(reader.read<std::uint16_t>());
  if (type == kErrorTlv || !has_data(message)) return message;
  const auto value = tlvs.subspan(reader.offset(), size - 2U);
  if (read_data(value, message)) return message;
  return bad_tlv(value.size() + 2, value.size(), kBodySize + 2);  // even, and not this
}

ManagementBytes encode_management(const ManagementMessage& message) noexcept {
  ManagementBytes bytes;
  // A management message has no time: this cannot fail but by the header's correction, which is 0.
  Header header = message.header;
  header.correction = Duration{};
  const auto start = encode(Message{header, message.body});
  std::copy_n(start->octets.begin(), kBodySize, bytes.octets.begin());
  Writer writer(std::span(bytes.octets).subspan(kBodySize + kTlvHeaderSize));
  if (message.error) {
    writer.integer(static_cast<std::uint16_t>(*message.error));
    writer.integer(static_cast<std::uint16_t>(message.id));
    writer.reserved(kErrorValueSize - 4);
  } else {
    const ManagementId id = message.data ? id_of(*message.data) : message.id;
    writer.integer(static_cast<std::uint16_t>(id));
    if (message.data) {
      ftcs::visit([&writer](const auto& data) { fields(writer, data); }, *message.data);
    }
    writer.reserved(writer.size() % 2);  // 14.1: lengths are even
  }
  const std::size_t size = kBodySize + kTlvHeaderSize + writer.size();
  ByteWriter tlv(std::span(bytes.octets).subspan(kBodySize));
  tlv.write<2>(message.error ? kErrorTlv : kManagementTlv);
  tlv.write<2>(writer.size());
  ByteWriter(std::span(bytes.octets).subspan(kLengthOffset)).write<2>(size);
  bytes.size = static_cast<std::uint16_t>(size);
  return bytes;
}

}  // namespace ftcs::ptp
