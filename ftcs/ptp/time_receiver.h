// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/ptp/acceptable_transmitters.h"
#include "ftcs/ptp/actions.h"
#include "ftcs/ptp/best_transmitter.h"
#include "ftcs/ptp/delay_requests.h"
#include "ftcs/ptp/fast_start.h"
#include "ftcs/ptp/peer_delay.h"
#include "ftcs/ptp/port.h"
#include "ftcs/ptp/reference_watch.h"
#include "ftcs/ptp/sequence_window.h"
#include "ftcs/ptp/sync_matcher.h"

namespace ftcs::ptp {

/// One port that receives. Clauses are IEEE 1588-2019's unless another standard is named. Nothing
/// is checked here: an interval outside 2^-7 to 2^7 s is not used, other fields outside their
/// ranges are taken at their word.
struct TimeReceiverConfig {
  PortIdentity port{};                         ///< our own; unique in the network
  std::uint8_t domain = 0;                     ///< 7.1
  std::uint8_t major_sdo_id = 0;               ///< 7.1.4; other profiles' messages are not for us
  std::uint8_t minor_version = 1;              ///< of what we send: 1 = 1588-2019, 0 = 1588-2008
  std::int8_t log_announce_interval = 1;       ///< only where an Announce does not tell (unicast)
  std::uint8_t announce_receipt_timeout = 3;   ///< announce intervals, 7.7.3.1; valid: 2 to 10
  std::int8_t log_min_delay_req_interval = 0;  ///< until a Delay_Resp demands another one
  bool unicast = false;  ///< Delay_Req to the one configured peer instead of multicast
  /// Delay_Req to the transmitter's own address, everything else by multicast (ptp4l: hybrid_e2e).
  bool hybrid = false;
  DelayMechanism delay_mechanism = DelayMechanism::kEndToEnd;
  /// With capability_needed Announce, Sync and Follow_Up are dropped until the neighbour is
  /// capable.
  PeerDelayConfig peer_delay{};
  bool assume_two_step = false;  ///< of Sync and Pdelay_Resp, see PortConfig
  /// Sync intervals after which a transmitter that only announces counts as silent
  /// (802.1AS-2020, 10.7.3.1). 0: never.
  std::uint8_t sync_receipt_timeout = 0;
  AcceptableTransmitters acceptable{};  ///< empty: all
  /// See PortConfig. Syncs, Follow_Ups and Announces of the selected transmitter must also be new:
  /// see SequenceWindow.
  const SecurityAssociation* security = nullptr;
  /// While no transmitter is selected: its first Announce selects it (9.3.2.5 wants two), and the
  /// Syncs that come before are measured already.
  bool fast_start = false;
  /// delayAsymmetry (7.4.2): positive if the way to us is longer than the way back. Added to both
  /// pairs' reference (11.6.2, 11.6.3); leave it zero where the measurement layer is given it.
  Duration delay_asymmetry{};
  std::uint64_t seed = 1;  ///< of the Delay_Req intervals; give each receiver another one
  /// Sequence id of the first Delay_Req. Where it is another one after each start, recorded
  /// answers, authentic though they are, answer nothing.
  std::uint16_t first_request_id = 0;
};

/// A correctionField beyond this is refused: no network holds a message for a second.
inline constexpr Nanoseconds kMaximumCorrection{1'000'000'000};

/// An IEEE 1588-2019 ordinary clock that only receives time: end-to-end (11.3) or peer-to-peer
/// (11.4) delay, best transmitter (9.3).
///
/// Sans-I/O: bytes and stamps go in, actions come out; it reads no clock and sends nothing itself.
/// `now` and all event stamps are readings of the free-running clock. `now` must not run backward.
/// It emits pairs and never judges a delay: that is for measurement and servo. No heap, no
/// exceptions; each input costs a bounded time.
///
/// What is emitted, A being delayAsymmetry (11.6):
///
///     forward    reference = t1 + corrections of Sync and Follow_Up + A,  free_running = t2
///     backward   reference = t4 - correction of Delay_Resp + A,           free_running = t3
///     peer       mean_link_delay = ((t4 - t1) r - (t3 - t2)) / 2          (PeerDelay)
///
///     TimeReceiver port({.port = {ClockIdentity::from_mac(mac), 1}, .domain = 0});
///     for (const Action& action : port.start(now)) perform(action);
///     for (const Action& action : port.on_event_message(octets, t2, now)) perform(action);
///     // SendMessage on Channel::kEvent: send it, then on_transmit_timestamp(its id(), stamp, now)
///
/// A message that cannot be used changes nothing but a counter, whose name says why (Counter). The
/// way from pairs to a steered clock is node::ReceiverNode's. What the standard leaves open, and
/// what was chosen: docs/spec-notes/ieee1588.md.
class TimeReceiver {
 public:
  using Config = TimeReceiverConfig;
  using Stamp = FreeRunningTime;  ///< of event messages
  /// In INITIALIZING. A security association is not owned and must outlive the receiver.
  explicit TimeReceiver(const Config& config) noexcept;

  /// INITIALIZING to LISTENING. Before, everything is ignored.
  [[nodiscard]] ActionList start(FreeRunningTime now) noexcept;
  /// A message of the event port (UDP 319; messageType below 8 on IEEE 802.3) with its receive
  /// stamp, the latency of the interface taken off. Without a stamp a Sync is of no use: hand it to
  /// on_general_message(), where it is counted as kWrongChannel.
  [[nodiscard]] ActionList on_event_message(std::span<const std::uint8_t> bytes,
                                            FreeRunningTime received, FreeRunningTime now) noexcept;
  /// A message of the general port (UDP 320). May come before or after the event message that it
  /// belongs to.
  [[nodiscard]] ActionList on_general_message(std::span<const std::uint8_t> bytes,
                                              FreeRunningTime now) noexcept;
  /// When the event message with this id left us, the latency of the interface added. Once for each
  /// message; of one that nobody waits for it is counted and ignored.
  [[nodiscard]] ActionList on_transmit_timestamp(const EventId& id, FreeRunningTime sent,
                                                 FreeRunningTime now) noexcept;
  /// It is not known and never will be when the event message with this id left us.
  [[nodiscard]] ActionList on_transmit_timestamp_missing(const EventId& id,
                                                         FreeRunningTime now) noexcept;
  /// Sends what is due, ends what has timed out (announceReceiptTimeout, 9.2.6.12). Calling it
  /// early does no harm.
  [[nodiscard]] ActionList on_timer(FreeRunningTime now) noexcept;
  /// To FAULTY; transmitter and open exchanges are forgotten.
  [[nodiscard]] ActionList on_link_down(FreeRunningTime now) noexcept;
  /// From FAULTY to LISTENING.
  [[nodiscard]] ActionList on_link_up(FreeRunningTime now) noexcept;
  /// UNCALIBRATED to SLAVE. It holds until on_servo_unlocked() or another reference: if the same
  /// transmitter returns after a fault and the servo has never lost lock, the next forward pair
  /// leads back to SLAVE.
  [[nodiscard]] ActionList on_servo_locked(FreeRunningTime now) noexcept;
  /// SLAVE to UNCALIBRATED.
  [[nodiscard]] ActionList on_servo_unlocked(FreeRunningTime now) noexcept;
  /// The selected transmitter tells a time that nobody wants to follow: any other is preferred for
  /// ForeignTransmitters::kDoubtTime, and while there is none it stays selected.
  [[nodiscard]] ActionList on_transmitter_doubted(FreeRunningTime now) noexcept;

  /// When on_timer() must be called, if no other input comes first. May lie in the past: then at
  /// once.
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const noexcept;
  [[nodiscard]] PortState state() const noexcept { return port_.state(); }
  /// The selected transmitter; null if there is none. Valid until the next input.
  [[nodiscard]] const TransmitterData* transmitter() const noexcept;
  [[nodiscard]] DelayMechanism delay_mechanism() const noexcept { return config_.delay_mechanism; }
  /// What the neighbour at the other end of the link measured as; peer to peer only.
  [[nodiscard]] const PeerDelay& peer_delay() const noexcept { return peer_delay_; }
  /// Rate of the grandmaster in units of our oscillator by the Follow_Up information (802.1AS-2020,
  /// 10.2.8.1.4): (1 + cumulativeScaledRateOffset 2^-41) neighborRateRatio; none where the
  /// transmitter sends none.
  [[nodiscard]] std::optional<Rate> grandmaster_rate_ratio() const noexcept;
  /// Its Sync interval, once a multicast Sync has told it.
  [[nodiscard]] std::optional<Duration> sync_interval() const noexcept { return sync_interval_; }
  /// Mean time between Delay_Req messages, as configured or as the transmitter demands.
  [[nodiscard]] Duration delay_request_interval() const noexcept {
    return delay_requests_.interval();
  }
  /// Since construction; no fault and no other transmitter clears them.
  [[nodiscard]] const Counters& counters() const noexcept { return port_.counters(); }

 private:
  struct Input {
    std::optional<FreeRunningTime> received;
    FreeRunningTime now{};
  };

  void dispatch(const Message& message, const Input& input, ActionList& actions) noexcept;
  [[nodiscard]] bool usable_source(const Header& header) noexcept;
  [[nodiscard]] bool from_transmitter(const Message& message, FreeRunningTime now) noexcept;
  [[nodiscard]] bool usable_correction(const Header& header) noexcept;
  [[nodiscard]] Duration believed_interval(const Header& header, FreeRunningTime now) noexcept;
  void on_announce(const Header& header, const Announce& announce, FreeRunningTime now,
                   ActionList& actions) noexcept;
  void on_sync(const Header& header, const Sync& sync, const Input& input,
               ActionList& actions) noexcept;
  void on_follow_up(const Header& header, const FollowUp& follow_up, FreeRunningTime now,
                    ActionList& actions) noexcept;
  void on_delay_resp(const Header& header, const DelayResp& response, FreeRunningTime now,
                     ActionList& actions) noexcept;
  [[nodiscard]] bool believes_information(const FollowUp& follow_up, FreeRunningTime now,
                                          ActionList& actions) noexcept;
  bool decide(FreeRunningTime now, ActionList& actions) noexcept;
  void select(const TransmitterData& data, FreeRunningTime now, ActionList& actions) noexcept;
  void deliver(const EventPair& pair, ActionList& actions) noexcept;
  void lose_transmitter(Counter reason, FreeRunningTime now, ActionList& actions) noexcept;
  [[nodiscard]] std::optional<FreeRunningTime> sync_timeout() const noexcept;
  void send_delay_req_if_due(FreeRunningTime now, ActionList& actions) noexcept;
  bool emit(std::optional<EventPair> pair, FreeRunningTime now, ActionList& actions) noexcept;
  [[nodiscard]] bool is_new(const Header& header, FreeRunningTime now) noexcept;
  [[nodiscard]] bool is_new_announce(const Header& header, FreeRunningTime now) noexcept;
  [[nodiscard]] bool believes(const EventPair& pair, FreeRunningTime now,
                              ActionList& actions) noexcept;
  void follow_jump(Duration jump, FreeRunningTime now, ActionList& actions) noexcept;
  void forget_exchanges() noexcept;
  [[nodiscard]] bool peer_to_peer() const noexcept {
    return config_.delay_mechanism == DelayMechanism::kPeerToPeer;
  }

  Config config_;
  Port port_;
  PeerDelay peer_delay_;
  ForeignTransmitters foreign_;
  FastStart fast_start_;
  bool has_transmitter_ = false;
  bool had_transmitter_ = false;  ///< transmitter_ holds at least the last one
  TransmitterData transmitter_{};
  std::optional<Duration> sync_interval_;
  SyncMatcher matcher_;
  SequenceWindow sequence_window_;  ///< of Sync and Follow_Up
  DelayRequests delay_requests_;
  ReferenceWatch reference_;
  std::optional<Duration> untold_jump_{};  ///< found while none was selected
  FreeRunningTime last_sync_{};            ///< of the followed transmitter, or when it was selected
  bool has_information_ = false;
  FollowUpInformation information_{};
  std::uint16_t new_time_base_ = 0;  ///< another indicator than the believed one, told so often
  int new_time_base_told_ = 0;
  FreeRunningTime new_time_base_since_{};
  bool servo_locked_ = false;
};

}  // namespace ftcs::ptp
