// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "ftcs/ptp/port_state.h"
#include "ftcs/ptp/wire/codec.h"
#include "ftcs/time/duration.h"

namespace ftcs::ptp {

/// managementId, 15.5.2.3. Those from 0xC000 on are linuxptp's own, as its pmc shows them.
enum class ManagementId : std::uint16_t {
  kNullManagement = 0x0000,
  kClockDescription = 0x0001,
  kUserDescription = 0x0002,
  kDefaultDataSet = 0x2000,
  kCurrentDataSet = 0x2001,
  kParentDataSet = 0x2002,
  kTimePropertiesDataSet = 0x2003,
  kPortDataSet = 0x2004,
  kDomain = 0x2007,
  kTimeStatusNp = 0xC000,
  kPortDataSetNp = 0xC002,
  kSubscribeEventsNp = 0xC003,
  kPortPropertiesNp = 0xC004,
  kPortStatsNp = 0xC005,
};

/// actionField, 15.4.1.6.
enum class ManagementAction : std::uint8_t {
  kGet = 0,          ///< tell it
  kSet = 1,          ///< change it
  kResponse = 2,     ///< the answer to both
  kCommand = 3,      ///< do it
  kAcknowledge = 4,  ///< the answer to that
};

/// managementErrorId, 15.5.4.2.
enum class ManagementError : std::uint16_t {
  kResponseTooBig = 0x0001,  ///< the answer does not fit into one message
  kNoSuchId = 0x0002,        ///< managementId is not known
  kWrongLength = 0x0003,     ///< of the data
  kWrongValue = 0x0004,      ///< in the data, or a port that is not there
  kNotSetable = 0x0005,      ///< it can be read alone
  kNotSupported = 0x0006,    ///< it is known, and the action is not
  kGeneral = 0xFFFE,         ///< any other
};

/// 5.3.9 PTPText: a length octet and that many octets of UTF-8. Longer text is cut.
template <std::size_t kCapacity>
struct PtpText {
  static_assert(kCapacity < 256);
  std::array<char, kCapacity> characters{};
  std::uint8_t size = 0;

  constexpr PtpText() noexcept = default;
  constexpr explicit PtpText(std::string_view text) noexcept {
    for (const char character : text.substr(0, kCapacity)) characters[size++] = character;
  }
  [[nodiscard]] constexpr std::string_view view() const noexcept {
    return {characters.data(), size};
  }
  friend constexpr bool operator==(const PtpText&, const PtpText&) noexcept = default;
};

/// An address behind a 16-bit length (5.3.6): up to the 16 octets of IPv6.
struct AddressOctets {
  std::array<std::uint8_t, 16> octets{};
  std::uint16_t size = 0;
  friend constexpr bool operator==(const AddressOctets&, const AddressOctets&) noexcept = default;
};

/// 15.5.3.1.1: says that somebody is there.
struct NullManagement {
  friend constexpr bool operator==(const NullManagement&, const NullManagement&) noexcept = default;
};
/// 15.5.3.1.2.
struct ClockDescription {
  std::uint16_t clock_type = 0x8000;  ///< an ordinary clock
  PtpText<32> physical_layer{};
  AddressOctets physical_address{};
  std::uint16_t network_protocol = 1;  ///< 7.4.1: 1 UDP/IPv4, 2 UDP/IPv6, 3 IEEE 802.3
  AddressOctets protocol_address{};
  std::array<std::uint8_t, 3> manufacturer{};
  PtpText<64> product{};
  PtpText<32> revision{};
  PtpText<128> user{};
  std::array<std::uint8_t, 6> profile{};
  friend constexpr bool operator==(const ClockDescription&,
                                   const ClockDescription&) noexcept = default;
};
/// 15.5.3.1.3.
struct UserDescription {
  PtpText<128> text{};
  friend constexpr bool operator==(const UserDescription&,
                                   const UserDescription&) noexcept = default;
};
/// defaultDS, 15.5.3.3.1.
struct DefaultDataSet {
  std::uint8_t flags = 0;  ///< 1: two-step, 2: receiver only
  std::uint16_t ports = 1;
  std::uint8_t priority1 = 128;
  ClockQuality quality{};
  std::uint8_t priority2 = 128;
  ClockIdentity identity{};
  std::uint8_t domain = 0;
  friend constexpr bool operator==(const DefaultDataSet&, const DefaultDataSet&) noexcept = default;
};
/// currentDS, 15.5.3.4.1.
struct CurrentDataSet {
  std::uint16_t steps_removed = 0;
  Duration offset{};           ///< local minus reference; ±2^47 ns in units of 2^-16 ns
  Duration mean_path_delay{};  ///< the same
  friend constexpr bool operator==(const CurrentDataSet&, const CurrentDataSet&) noexcept = default;
};
/// parentDS, 15.5.3.5.1. Its own statistics are not computed: the values say so (8.2.3.4).
struct ParentDataSet {
  PortIdentity parent{};
  std::uint8_t statistics = 0;
  std::uint16_t observed_variance = 0xFFFF;
  std::uint32_t observed_phase_change_rate = 0x7FFFFFFF;
  std::uint8_t grandmaster_priority1 = 128;
  ClockQuality grandmaster_quality{};
  std::uint8_t grandmaster_priority2 = 128;
  ClockIdentity grandmaster{};
  friend constexpr bool operator==(const ParentDataSet&, const ParentDataSet&) noexcept = default;
};
/// timePropertiesDS, 15.5.3.6.1.
struct TimePropertiesDataSet {
  std::int16_t utc_offset = 37;
  std::uint8_t flags = 0;  ///< the lower octet of an Announce's flagField: flag::kLeap61 ...
  std::uint8_t time_source = 0xA0;
  friend constexpr bool operator==(const TimePropertiesDataSet&,
                                   const TimePropertiesDataSet&) noexcept = default;
};
/// portDS.delayMechanism, 8.2.15.4.4.
inline constexpr std::uint8_t kEndToEndMechanism = 1;
inline constexpr std::uint8_t kPeerToPeerMechanism = 2;
/// portDS, 15.5.3.7.1. Intervals are log2 of seconds.
struct PortDataSet {
  PortIdentity port{};
  PortState state = PortState::kInitializing;
  std::int8_t log_min_delay_req_interval = 0;
  Duration mean_link_delay{};
  std::int8_t log_announce_interval = 1;
  std::uint8_t announce_receipt_timeout = 3;
  std::int8_t log_sync_interval = 0;
  std::uint8_t delay_mechanism = kEndToEndMechanism;
  std::int8_t log_min_pdelay_req_interval = 0;
  std::uint8_t version = kVersion;  ///< upper four bits: minor version (of 1588-2019)
  friend constexpr bool operator==(const PortDataSet&, const PortDataSet&) noexcept = default;
};
/// 15.5.3.3 DOMAIN.
struct Domain {
  std::uint8_t domain = 0;
  friend constexpr bool operator==(const Domain&, const Domain&) noexcept = default;
};
/// linuxptp's TIME_STATUS_NP: the last sample.
struct TimeStatusNp {
  std::int64_t offset_ns = 0;           ///< local minus reference
  std::int64_t ingress_ns = 0;          ///< when the last Sync came, on the steered clock
  std::int32_t scaled_rate_offset = 0;  ///< IEEE 802.1AS, units of 2^-41
  std::int32_t scaled_phase_change = 0;
  std::uint16_t time_base_indicator = 0;
  std::array<std::uint8_t, 12> last_phase_change{};  ///< 802.1AS ScaledNs
  std::int32_t grandmaster_present = 0;
  ClockIdentity grandmaster{};
  friend constexpr bool operator==(const TimeStatusNp&, const TimeStatusNp&) noexcept = default;
};
/// linuxptp's PORT_DATA_SET_NP.
struct PortDataSetNp {
  std::uint32_t neighbour_delay_threshold_ns = 20'000'000;
  std::int32_t as_capable = 1;
  friend constexpr bool operator==(const PortDataSetNp&, const PortDataSetNp&) noexcept = default;
};
/// linuxptp's PORT_PROPERTIES_NP.
struct PortPropertiesNp {
  PortIdentity port{};
  PortState state = PortState::kInitializing;
  std::uint8_t timestamping = 0;  ///< 0 software, 1 hardware
  PtpText<32> interface {};
  friend constexpr bool operator==(const PortPropertiesNp&,
                                   const PortPropertiesNp&) noexcept = default;
};
/// linuxptp's PORT_STATS_NP: messages by messageType (13.3.2.3). Little-endian on the wire.
struct PortStatsNp {
  static constexpr std::size_t kTypes = 16;
  PortIdentity port{};
  std::array<std::uint64_t, kTypes> received{};
  std::array<std::uint64_t, kTypes> sent{};
  friend constexpr bool operator==(const PortStatsNp&, const PortStatsNp&) noexcept = default;
};

/// linuxptp's SUBSCRIBE_EVENTS_NP: who asks is told of these events for so long.
struct SubscribeEventsNp {
  static constexpr std::size_t kPortState = 0;  ///< a PORT_DATA_SET when the port's state changes
  std::uint16_t duration_s = 0;
  std::array<std::uint8_t, 64> events{};  ///< event n: bit n mod 8 of octet n / 8
  friend constexpr bool operator==(const SubscribeEventsNp&,
                                   const SubscribeEventsNp&) noexcept = default;
};

using ManagementData =
    std::variant<NullManagement, ClockDescription, UserDescription, DefaultDataSet, CurrentDataSet,
                 ParentDataSet, TimePropertiesDataSet, PortDataSet, Domain, TimeStatusNp,
                 PortDataSetNp, PortPropertiesNp, PortStatsNp, SubscribeEventsNp>;

/// The identifier of what a variant holds.
[[nodiscard]] ManagementId id_of(const ManagementData& data) noexcept;

/// One management message (15.4.1) with one TLV (15.5.2 or, with `error`, 15.5.4).
struct ManagementMessage {
  Header header{};
  Management body{};
  ManagementId id = ManagementId::kNullManagement;  ///< any 16 bits may come
  std::optional<ManagementError> error{};           ///< of a refusal
  /// Of a RESPONSE with an id that is known here, and of a SET of SUBSCRIBE_EVENTS_NP; another
  /// request's data is not read, as GET carries dummies.
  std::optional<ManagementData> data{};

  [[nodiscard]] constexpr ManagementAction action() const noexcept {
    return static_cast<ManagementAction>(body.action);
  }
  friend constexpr bool operator==(const ManagementMessage&,
                                   const ManagementMessage&) noexcept = default;
};

/// Octets of an encoded management message; the longest one (CLOCK_DESCRIPTION) fits.
struct ManagementBytes {
  std::array<std::uint8_t, 400> octets{};
  std::uint16_t size = 0;
  [[nodiscard]] constexpr std::span<const std::uint8_t> view() const noexcept {
    return {octets.data(), size};
  }
};

/// As decode(), and the TLV. Errors: as there; kUnknownType for another message than Management;
/// kMalformedTlv where the first TLV is missing, is none of management or does not have the length
/// of what it says it holds.
[[nodiscard]] Result<ManagementMessage, DecodeError> decode_management(
    std::span<const std::uint8_t> bytes) noexcept;

/// With neither error nor data: a TLV without data field, which is a GET as pmc -z sends it. `id`
/// is taken from data where there is data. Durations beyond ±2^47 ns are held there.
[[nodiscard]] ManagementBytes encode_management(const ManagementMessage& message) noexcept;

}  // namespace ftcs::ptp
