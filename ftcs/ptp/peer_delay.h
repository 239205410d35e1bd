// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ftcs/ptp/actions.h"
#include "ftcs/ptp/answer_limit.h"
#include "ftcs/ptp/port.h"

namespace ftcs::ptp {

/// IEEE 1588-2019, 8.2.15.4.4: how the delay of the path is measured. Both ends must agree.
enum class DelayMechanism : std::uint8_t {
  kEndToEnd,    ///< Delay_Req and Delay_Resp, 11.3
  kPeerToPeer,  ///< Pdelay_Req, Pdelay_Resp, Pdelay_Resp_Follow_Up, 11.4
};

/// How the neighbour is asked, and what is believed of its answers.
struct PeerDelayConfig {
  std::int8_t log_min_interval = 0;  ///< logMinPdelayReqInterval, valid: -7 to 7
  /// Whether the neighbour must be capable (IEEE 802.1AS-2020, 11.2.2): that it answers, alone, and
  /// that the delay lies within the limits below. Without it every neighbour is.
  bool capability_needed = false;
  Nanoseconds lowest{-20'000'000};  ///< min_neighbor_prop_delay
  Nanoseconds highest{20'000'000};  ///< neighborPropDelayThresh
  std::uint8_t allowed_losses = 9;  ///< allowedLostResponses, 802.1AS-2020, 11.5.3
  /// Of the way to us over the mean (7.4.2); the mean link delay is without it, the stamps are not.
  Duration asymmetry{};
  std::uint16_t first_request_id = 0;  ///< see TimeReceiverConfig
};

/// A mean link delay beyond this is nonsense, whatever the link.
inline constexpr Nanoseconds kMaximumPeerDelay{1'000'000'000};

/// The peer delay mechanism of one port, both sides of it: asks the neighbour (11.4.2) and answers
/// what it asks (two-step, with both stamps).
///
///     mean_link_delay = ((t4 - t1) r - (t3 - t2)) / 2
///
/// t1, t4 by our clock, t2, t3 by the neighbour's; (t3 - t2) comes as two Timestamps and two
/// corrections, or as one correction (one-step); r is the rate of the neighbour's clock in units of
/// ours, from t3 and t4 of the last eight answers: over 10 ms of turn-around, 50 ppm would be
/// 250 ns of delay. r is 1 until two answers with Timestamps have come.
///
/// All stamps are readings of the port's clock, which nobody steers.
class PeerDelay {
 public:
  explicit PeerDelay(const PeerDelayConfig& config) noexcept;

  /// The first request is due at once.
  void start(FreeRunningTime now) noexcept;
  /// Open exchanges, the neighbour and its rate are forgotten.
  void stop() noexcept;
  /// When on_timer() must be called; none while it is stopped.
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const noexcept;

  /// Sends the next request if it is due, and counts the last one as lost if it is still open.
  void on_timer(FreeRunningTime now, Port& port, ActionList& actions) noexcept;
  /// Any of the three messages; counted and ignored unless running.
  void on_message(const Message& message, std::optional<FreeRunningTime> received, Port& port,
                  ActionList& actions) noexcept;
  /// Of a Pdelay_Req or a Pdelay_Resp.
  void on_sent(const EventId& id, FreeRunningTime sent, Port& port, ActionList& actions) noexcept;
  /// It is overdue, which is counted; one that comes later is used all the same.
  void on_stamp_missing(const EventId& id, Port& port) noexcept;

  /// Rate of the reference in units of the neighbour's clock: what is emitted is by the reference.
  void set_reference_rate(Rate reference_per_neighbour) noexcept {
    reference_rate_ = reference_per_neighbour;
  }
  /// The followed transmitter; none: nobody is, or its Syncs and its neighbours' stamps are not of
  /// one timescale (802.1AS, where each clock runs freely).
  void set_transmitter(const std::optional<PortIdentity>& port) noexcept { transmitter_ = port; }
  /// The reference has jumped: an exchange that is open has stamps of before and after.
  void abandon_exchange() noexcept { exchange_.open = false; }
  /// asCapable (802.1AS-2020, 10.2.5.1); always true where it is not needed.
  [[nodiscard]] bool capable() const noexcept;
  /// neighborRateRatio (802.1AS-2020, 10.2.5.7): the neighbour's clock in units of ours; 1 until
  /// known.
  [[nodiscard]] Rate neighbor_rate_ratio() const noexcept { return rate_ratio_; }
  /// The last one, without the asymmetry; none before the first.
  [[nodiscard]] std::optional<Duration> mean_link_delay() const noexcept;

 private:
  /// One request and what came for it. The parts may come in any order.
  struct Exchange {
    bool open = false;
    bool sent = false;
    bool overdue = false;  ///< our stamp, and counted
    bool answered = false;
    bool two_step = false;
    bool followed_up = false;
    bool several = false;  ///< more than one port has answered
    std::uint16_t sequence_id = 0;
    FreeRunningTime t1{};
    FreeRunningTime t4{};
    PortIdentity responder{};
    PortIdentity follower{};
    ReferenceTime request_receipt{};
    ReferenceTime response_origin{};
    Duration correction{};            ///< of the answer
    Duration follow_up_correction{};  ///< of its Follow_Up
  };
  /// An answer of ours. It is remembered for a while after its transmit stamp has come, so that a
  /// copy of the request is not answered with other stamps.
  struct Answer {
    bool known = false;
    bool open = false;     ///< the stamp is awaited
    bool overdue = false;  ///< and counted
    EventId id{};
    Duration correction{};  ///< of the request
  };
  struct Instant {
    ReferenceTime neighbour{};  ///< t3
    FreeRunningTime ours{};     ///< t4
  };
  static constexpr std::size_t kOpenAnswers = 4;
  static constexpr std::size_t kInstants = 8;
  /// A link has one other end; more, so that what is no link between two ports is found out.
  static constexpr std::size_t kNeighbours = 4;

  void on_request(const Header& header, FreeRunningTime received, Port& port,
                  ActionList& actions) noexcept;
  void on_response(const Header& header, const PdelayResp& response, FreeRunningTime received,
                   Port& port, ActionList& actions) noexcept;
  void on_follow_up(const Header& header, const PdelayRespFollowUp& follow_up, Port& port,
                    ActionList& actions) noexcept;
  [[nodiscard]] bool usable_correction(const Header& header, Port& port) const noexcept;
  [[nodiscard]] Exchange* asked(std::uint16_t sequence_id, const PortIdentity& requester,
                                Port& port) noexcept;
  void close_exchange(Port& port) noexcept;
  void complete_if_ready(Port& port, ActionList& actions) noexcept;
  void measure_rate(Port& port) noexcept;
  void forget_rate() noexcept;
  [[nodiscard]] std::optional<PeerStamps> stamps() const noexcept;
  [[nodiscard]] Answer* find_answer(const EventId& id) noexcept;

  PeerDelayConfig config_;
  Duration interval_;
  bool running_ = false;
  FreeRunningTime next_at_{};
  std::uint16_t next_id_ = 0;
  Exchange exchange_{};
  std::array<Answer, kOpenAnswers> answers_{};
  std::size_t next_answer_ = 0;
  AnswerLimit<kNeighbours> answer_limit_{};

  std::array<Instant, kInstants> instants_{};
  std::size_t instant_count_ = 0;
  std::size_t next_instant_ = 0;
  Rate reference_rate_;
  Rate rate_ratio_;
  bool rate_known_ = false;
  bool measured_ = false;
  Duration mean_link_delay_{};
  PortIdentity neighbour_{};
  std::optional<PortIdentity> transmitter_{};
  std::uint8_t losses_ = 0;      ///< requests in a row that nobody answered
  std::uint8_t suspicious_ = 0;  ///< requests to come that must have one answer before one counts
};

}  // namespace ftcs::ptp
