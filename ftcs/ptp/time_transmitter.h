// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/ptp/actions.h"
#include "ftcs/ptp/answer_limit.h"
#include "ftcs/ptp/peer_delay.h"
#include "ftcs/ptp/port.h"

namespace ftcs::ptp {

/// One port that transmits. Clauses are IEEE 1588-2019's unless another standard is named.
struct TimeTransmitterConfig {
  PortIdentity port{};             ///< our own; its clock is the grandmaster that we announce
  std::uint8_t domain = 0;         ///< 7.1
  std::uint8_t major_sdo_id = 0;   ///< 7.1.4
  std::uint8_t minor_version = 1;  ///< 1 = 1588-2019, 0 = 1588-2008
  std::int8_t log_announce_interval = 1;       ///< valid: -7 to 7
  std::int8_t log_sync_interval = 0;           ///< valid: -7 to 7
  std::int8_t log_min_delay_req_interval = 0;  ///< demanded of receivers
  std::uint8_t priority1 = 128;
  std::uint8_t priority2 = 128;
  ClockQuality quality{};
  std::int16_t utc_offset = 37;
  std::uint16_t announce_flags = 0;  ///< flag::kPtpTimescale, kUtcOffsetValid, kTimeTraceable ...
  std::uint8_t time_source = 0xA0;   ///< 7.6.2.8; 0xA0 = internal oscillator
  bool unicast = false;              ///< everything to the one configured peer instead of multicast
  DelayMechanism delay_mechanism = DelayMechanism::kEndToEnd;
  /// With capability_needed nothing is announced or sent until the neighbour is capable.
  PeerDelayConfig peer_delay{};
  bool assume_two_step = false;  ///< of Pdelay_Resp, see PortConfig
  bool follow_up_info = false;   ///< send the Follow_Up information TLV (802.1AS-2020, 11.4.4.3)
  bool path_trace = false;       ///< send a PATH_TRACE TLV in Announce (16.2)
  const SecurityAssociation* security = nullptr;  ///< see PortConfig
};

/// A grandmaster for the lab: it transmits whatever others announce. Two-step Sync, Announce,
/// Delay_Resp or, peer to peer, both sides of the peer delay mechanism.
///
/// Sans-I/O as TimeReceiver. Its clock *is* the reference: event stamps are ReferenceTime; `now`
/// only drives timers and is read from the free-running clock. Messages to a receiver that asked by
/// unicast go back by unicast.
class TimeTransmitter {
 public:
  using Config = TimeTransmitterConfig;
  using Stamp = ReferenceTime;  ///< of event messages
  explicit TimeTransmitter(const Config& config) noexcept;

  /// INITIALIZING to LISTENING to MASTER; first Announce and Sync are due at once.
  [[nodiscard]] ActionList start(FreeRunningTime now) noexcept;
  /// A Delay_Req (11.3) or a peer delay message (11.4), with its receive stamp, which is t4 or t2.
  [[nodiscard]] ActionList on_event_message(std::span<const std::uint8_t> bytes,
                                            ReferenceTime received, FreeRunningTime now) noexcept;
  [[nodiscard]] ActionList on_general_message(std::span<const std::uint8_t> bytes,
                                              FreeRunningTime now) noexcept;
  /// When the event message with this id left us: the Follow_Up is sent.
  [[nodiscard]] ActionList on_transmit_timestamp(const EventId& id, ReferenceTime sent,
                                                 FreeRunningTime now) noexcept;
  /// No Follow_Up is sent.
  [[nodiscard]] ActionList on_transmit_timestamp_missing(const EventId& id,
                                                         FreeRunningTime now) noexcept;
  /// Announce and Sync, as they are due. After a pause one of each, then the schedule.
  [[nodiscard]] ActionList on_timer(FreeRunningTime now) noexcept;
  /// To FAULTY: nothing is sent.
  [[nodiscard]] ActionList on_link_down(FreeRunningTime now) noexcept;
  [[nodiscard]] ActionList on_link_up(FreeRunningTime now) noexcept;

  /// When on_timer() must be called; none while nothing is to be sent.
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const noexcept;
  [[nodiscard]] PortState state() const noexcept { return port_.state(); }
  /// What the neighbour at the other end of the link measured as; peer to peer only.
  [[nodiscard]] const PeerDelay& peer_delay() const noexcept { return peer_delay_; }
  [[nodiscard]] const Counters& counters() const noexcept { return port_.counters(); }

 private:
  /// A Sync whose transmit stamp is awaited.
  struct OpenSync {
    bool open = false;
    std::uint16_t sequence_id = 0;
    bool overdue = false;  ///< its stamp, and counted
  };
  /// Transmit stamps may lag behind by as many Syncs.
  static constexpr std::size_t kOpenSyncs = 4;
  /// Receivers with a share of their own of the answers.
  static constexpr std::size_t kReceivers = 64;

  void dispatch(const Message& message, std::optional<ReferenceTime> received,
                ActionList& actions) noexcept;
  void answer(const Header& request, ReferenceTime received, ActionList& actions) noexcept;
  void begin_transmitting(FreeRunningTime now, ActionList& actions) noexcept;
  void send_announce(ActionList& actions) noexcept;
  void send_sync(ActionList& actions) noexcept;
  [[nodiscard]] bool peer_to_peer() const noexcept {
    return config_.delay_mechanism == DelayMechanism::kPeerToPeer;
  }
  [[nodiscard]] OpenSync* find(std::uint16_t sequence_id) noexcept;

  Config config_;
  Duration announce_interval_;
  Duration sync_interval_;
  Port port_;
  PeerDelay peer_delay_;
  AnswerLimit<kReceivers> answer_limit_;
  FreeRunningTime next_announce_{};
  FreeRunningTime next_sync_{};
  std::uint16_t next_announce_id_ = 0;
  std::uint16_t next_sync_id_ = 0;
  std::array<OpenSync, kOpenSyncs> open_syncs_{};
};

}  // namespace ftcs::ptp
