// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "ftcs/ptp/wire/identity.h"
#include "ftcs/time/instant.h"

namespace ftcs::ptp {

/// IEEE 1588-2019, 13.3.2.3, Table 36. Values below 8 are event messages: they are timestamped.
enum class MessageType : std::uint8_t {
  kSync = 0x0,
  kDelayReq = 0x1,
  kPdelayReq = 0x2,
  kPdelayResp = 0x3,
  kFollowUp = 0x8,
  kDelayResp = 0x9,
  kPdelayRespFollowUp = 0xA,
  kAnnounce = 0xB,
  kSignaling = 0xC,
  kManagement = 0xD,
};

/// It is stamped when it leaves and when it arrives.
[[nodiscard]] constexpr bool is_event(MessageType type) noexcept {
  return static_cast<std::uint8_t>(type) < 0x8;
}

/// flagField, 13.3.2.8, Table 37: the first octet is the upper byte here.
namespace flag {
inline constexpr std::uint16_t kAlternateTransmitter = 0x0100;      ///< 17.3: not to be followed
inline constexpr std::uint16_t kTwoStep = 0x0200;                   ///< a Follow_Up has the time
inline constexpr std::uint16_t kUnicast = 0x0400;                   ///< sent to one address
inline constexpr std::uint16_t kLeap61 = 0x0001;                    ///< today ends with 23:59:60
inline constexpr std::uint16_t kLeap59 = 0x0002;                    ///< today ends with 23:59:58
inline constexpr std::uint16_t kUtcOffsetValid = 0x0004;            ///< currentUtcOffset is right
inline constexpr std::uint16_t kPtpTimescale = 0x0008;              ///< TAI, else any epoch
inline constexpr std::uint16_t kTimeTraceable = 0x0010;             ///< to a primary reference
inline constexpr std::uint16_t kFrequencyTraceable = 0x0020;        ///< to a primary reference
inline constexpr std::uint16_t kSynchronizationUncertain = 0x0040;  ///< its time is not sure (yet)
}  // namespace flag

/// logMessageInterval of messages that have none, and of unicast messages (13.3.2.14, Table 42).
inline constexpr std::int8_t kNoLogInterval = 0x7F;

/// versionPTP (13.3.2.5): 2 for both 1588-2008 and 1588-2019, which differ in minorVersionPTP.
inline constexpr std::uint8_t kVersion = 2;

/// The common header, 13.3.1, Table 35. messageLength and controlField follow from the body;
/// messageTypeSpecific is sent as zero and ignored. What the decoder met is in `minor_version`; any
/// value is accepted.
struct Header {
  std::uint8_t major_sdo_id = 0;   ///< 13.3.2.2; "transportSpecific" in 1588-2008. 4 bits
  std::uint8_t minor_version = 1;  ///< 13.3.2.4, 4 bits
  std::uint8_t domain = 0;         ///< 13.3.2.7
  std::uint8_t minor_sdo_id = 0;   ///< 13.3.2.2; reserved in 1588-2008
  std::uint16_t flags = 0;         ///< see namespace flag
  Duration correction{};           ///< correctionField, 13.3.2.9: ±2^47 ns in units of 2^-16 ns
  PortIdentity source{};           ///< 13.3.2.11
  std::uint16_t sequence_id = 0;   ///< 13.3.2.12
  std::int8_t log_interval = kNoLogInterval;  ///< 13.3.2.14, log2 of seconds

  [[nodiscard]] constexpr bool has(std::uint16_t mask) const noexcept {
    return (flags & mask) != 0;
  }
  friend constexpr bool operator==(const Header&, const Header&) noexcept = default;
};

/// 5.3.7 and 7.6.2: what a clock says about itself. Lower is better in each field.
struct ClockQuality {
  std::uint8_t clock_class = 248;      ///< 7.6.2.5; 248 = default, 255 = receiver only
  std::uint8_t clock_accuracy = 0xFE;  ///< 7.6.2.6; 0xFE = unknown
  std::uint16_t offset_scaled_log_variance = 0xFFFF;  ///< 7.6.3.5; 0xFFFF = not computed
  friend constexpr bool operator==(const ClockQuality&, const ClockQuality&) noexcept = default;
};

/// 13.5.1, Table 43. TLVs of what is received are skipped.
struct Announce {
  ReferenceTime origin{};
  std::int16_t utc_offset = 0;  ///< TAI - UTC in seconds, 7.2.4; 37 since 2017
  std::uint8_t priority1 = 128;
  ClockQuality quality{};
  std::uint8_t priority2 = 128;
  ClockIdentity grandmaster{};
  std::uint16_t steps_removed = 0;
  std::uint8_t time_source = 0xA0;  ///< 7.6.2.8; 0xA0 = internal oscillator
  /// Sent with a PATH_TRACE TLV (16.2) that names the grandmaster alone, as IEEE 802.1AS wants.
  bool path_trace = false;
  friend constexpr bool operator==(const Announce&, const Announce&) noexcept = default;
};

/// 13.6.1, Table 44. Of a two-step Sync the origin is an estimate, or zero: preciseOriginTimestamp
/// comes in the Follow_Up.
struct Sync {
  ReferenceTime origin{};  ///< originTimestamp: t1 of a one-step Sync
  friend constexpr bool operator==(const Sync&, const Sync&) noexcept = default;
};
/// 13.6.1, Table 44.
struct DelayReq {
  ReferenceTime origin{};
  friend constexpr bool operator==(const DelayReq&, const DelayReq&) noexcept = default;
};
/// IEEE 802.1AS-2020, 11.4.4.3: the Follow_Up information TLV.
struct FollowUpInformation {
  /// (rate of the grandmaster in units of the sender's clock - 1) times 2^41.
  std::int32_t cumulative_scaled_rate_offset = 0;
  /// Changes with each jump of the grandmaster's time or frequency.
  std::uint16_t gm_time_base_indicator = 0;
  Duration last_gm_phase_change{};  ///< of the last jump: time after it minus time before it
  std::int32_t scaled_last_gm_freq_change = 0;  ///< 2^-41
  /// Rate of the grandmaster in units of the sender's clock, less 1.
  [[nodiscard]] constexpr double cumulative_rate_offset() const noexcept {
    constexpr double kUnit = 1.0 / 2199023255552.0;  // 2^-41
    return static_cast<double>(cumulative_scaled_rate_offset) * kUnit;
  }
  friend constexpr bool operator==(const FollowUpInformation&,
                                   const FollowUpInformation&) noexcept = default;
};

/// 13.7.1, Table 45.
struct FollowUp {
  ReferenceTime precise_origin{};  ///< preciseOriginTimestamp: t1
  // Not std::optional: gcc 12 warns of uninitialised reads that cannot happen.
  bool has_information = false;
  FollowUpInformation information{};
  friend constexpr bool operator==(const FollowUp&, const FollowUp&) noexcept = default;
};
/// 13.8.1, Table 46.
struct DelayResp {
  ReferenceTime receive{};         ///< receiveTimestamp: t4
  PortIdentity requesting_port{};  ///< who asked; others ignore it
  friend constexpr bool operator==(const DelayResp&, const DelayResp&) noexcept = default;
};
/// 13.9.1, Table 47 (ten reserved octets follow on the wire).
struct PdelayReq {
  ReferenceTime origin{};
  friend constexpr bool operator==(const PdelayReq&, const PdelayReq&) noexcept = default;
};
/// 13.10.1, Table 48.
struct PdelayResp {
  ReferenceTime request_receipt{};  ///< t2; zero where turn-around is in the correction alone
  PortIdentity requesting_port{};
  friend constexpr bool operator==(const PdelayResp&, const PdelayResp&) noexcept = default;
};
/// 13.11.1, Table 49.
struct PdelayRespFollowUp {
  ReferenceTime response_origin{};  ///< t3; zero as above
  PortIdentity requesting_port{};
  friend constexpr bool operator==(const PdelayRespFollowUp&,
                                   const PdelayRespFollowUp&) noexcept = default;
};
/// 13.12.1, Table 50; its TLVs are checked and skipped.
struct Signaling {
  PortIdentity target{};
  friend constexpr bool operator==(const Signaling&, const Signaling&) noexcept = default;
};
/// 15.4.1, Table 56; its TLV is checked and skipped.
struct Management {
  PortIdentity target{};
  std::uint8_t starting_boundary_hops = 0;
  std::uint8_t boundary_hops = 0;
  std::uint8_t action = 0;  ///< 15.4.1.6, 4 bits
  friend constexpr bool operator==(const Management&, const Management&) noexcept = default;
};

using Body = std::variant<Sync, DelayReq, PdelayReq, PdelayResp, FollowUp, DelayResp,
                          PdelayRespFollowUp, Announce, Signaling, Management>;

/// One PTP message. Timestamps hold whole nanoseconds; a fraction travels in the correction.
struct Message {
  Header header{};
  Body body{};
  friend constexpr bool operator==(const Message&, const Message&) noexcept = default;
};

[[nodiscard]] constexpr MessageType type_of(const Body& body) noexcept {
  constexpr MessageType kTypes[] = {MessageType::kSync,
                                    MessageType::kDelayReq,
                                    MessageType::kPdelayReq,
                                    MessageType::kPdelayResp,
                                    MessageType::kFollowUp,
                                    MessageType::kDelayResp,
                                    MessageType::kPdelayRespFollowUp,
                                    MessageType::kAnnounce,
                                    MessageType::kSignaling,
                                    MessageType::kManagement};
  return kTypes[body.index()];
}

/// Octets on the wire without TLVs (Tables 43 to 50 and 56).
[[nodiscard]] constexpr std::size_t size_of(MessageType type) noexcept {
  switch (type) {
    case MessageType::kSync:
    case MessageType::kDelayReq:
    case MessageType::kFollowUp:
    case MessageType::kSignaling:
      return 44;
    case MessageType::kManagement:
      return 48;
    case MessageType::kPdelayReq:
    case MessageType::kPdelayResp:
    case MessageType::kPdelayRespFollowUp:
    case MessageType::kDelayResp:
      return 54;
    case MessageType::kAnnounce:
      return 64;
  }
  return 0;
}

}  // namespace ftcs::ptp
