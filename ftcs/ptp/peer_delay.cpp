// SPDX-License-Identifier: MIT
#include "ftcs/ptp/peer_delay.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "ftcs/ptp/interval.h"
#include "ftcs/ptp/wire/fields.h"
#include "ftcs/time/relabel.h"

namespace ftcs::ptp {
namespace {

/// As many requests must have one answer each before an answer counts again.
constexpr std::uint8_t kRequestsUntilTrusted = 3;
/// No two clocks that work differ by more: the neighbour's was stepped. Far above any oscillator,
/// and above what a clock is slewed by.
constexpr double kLargestRateDeviation = 0.02;
/// Shorter than this between the first answer and the last, and the noise of the stamps would be
/// taken for a rate.
constexpr double kShortestBaselineNs = 5e8;
/// Answers that come faster are not all remembered, so that eight of them span a second.
constexpr Duration kInstantSpacing{Nanoseconds{125'000'000}};
/// One correctionField holds at most a second (TimeReceiver's rule too).
constexpr Duration kLargestCorrection{Nanoseconds{1'000'000'000}};

/// A reading of the port's clock as it stands on the wire.
ReferenceTime on_wire(FreeRunningTime time) noexcept { return relabel<ReferenceTime>(time); }

}  // namespace

PeerDelay::PeerDelay(const PeerDelayConfig& config) noexcept
    : config_(config),
      interval_(
          interval_from_log(config.log_min_interval).value_or(Duration{std::chrono::seconds{1}})),
      next_id_(config.first_request_id) {}

void PeerDelay::start(FreeRunningTime now) noexcept {
  stop();
  running_ = true;
  next_at_ = now;
}

void PeerDelay::stop() noexcept {
  running_ = false;
  exchange_ = Exchange{};
  answers_ = {};
  forget_rate();
  measured_ = false;
  losses_ = 0;
  suspicious_ = 0;
}

std::optional<FreeRunningTime> PeerDelay::deadline() const noexcept {
  if (!running_) return std::nullopt;
  return next_at_;
}

void PeerDelay::on_timer(FreeRunningTime now, Port& port, ActionList& actions) noexcept {
  if (!running_ || now < next_at_) return;
  close_exchange(port);
  next_at_ = next_at_ + interval_ > now ? next_at_ + interval_ : now + interval_;
  exchange_ = Exchange{};
  exchange_.open = true;
  exchange_.sequence_id = next_id_++;
  const Message message{port.header(exchange_.sequence_id, config_.log_min_interval), PdelayReq{}};
  port.send(message, Destination::kNeighbour, Counter::kPdelayReqSent, actions);
}

/// What is still open when the next request is due was lost.
void PeerDelay::close_exchange(Port& port) noexcept {
  if (suspicious_ > 0 && !exchange_.several) --suspicious_;
  if (!exchange_.open) return;
  if (!exchange_.answered) {
    port.count(Counter::kLostPdelayResp);
    if (losses_ < std::numeric_limits<std::uint8_t>::max()) ++losses_;
    if (losses_ > config_.allowed_losses) forget_rate();
  } else if (exchange_.two_step && !exchange_.followed_up) {
    port.count(Counter::kLostPdelayRespFollowUp);
  } else if (!exchange_.sent && !exchange_.overdue && !exchange_.several) {
    port.count(Counter::kMissingTransmitStamp);
  }
}

void PeerDelay::on_message(const Message& message, std::optional<FreeRunningTime> received,
                           Port& port, ActionList& actions) noexcept {
  if (!running_) return port.count(Counter::kPdelayIgnored);
  const Header& header = message.header;
  if (is_event(type_of(message.body)) && !received) return port.count(Counter::kWrongChannel);
  if (!usable_correction(header, port)) return;
  if (const auto* response = std::get_if<PdelayResp>(&message.body)) {
    on_response(header, *response, *received, port, actions);
  } else if (const auto* follow_up = std::get_if<PdelayRespFollowUp>(&message.body)) {
    on_follow_up(header, *follow_up, port, actions);
  } else {
    on_request(header, *received, port, actions);
  }
}

bool PeerDelay::usable_correction(const Header& header, Port& port) const noexcept {
  if (abs(header.correction) <= kLargestCorrection) return true;
  port.count(Counter::kAbsurdCorrection);
  return false;
}

/// 11.4.2: answered at once; t3 follows in a Pdelay_Resp_Follow_Up. What requestReceiptTimestamp
/// cannot hold of t2 is taken off the correction.
void PeerDelay::on_request(const Header& header, FreeRunningTime received, Port& port,
                           ActionList& actions) noexcept {
  const EventId id{MessageType::kPdelayResp, header.sequence_id, header.source};
  if (std::ranges::any_of(answers_, [&](const Answer& a) { return a.known && a.id == id; })) {
    return port.count(Counter::kDuplicatePdelayReq);
  }
  if (!answer_limit_.admits(header.source, received)) return port.count(Counter::kAnswersRefused);
  port.count(Counter::kPdelayReqReceived);
  Message message{port.header(header.sequence_id, kNoLogInterval),
                  PdelayResp{on_wire(received), header.source}};
  message.header.flags |= flag::kTwoStep;
  message.header.correction = -fraction_of(on_wire(received));
  Answer& answer = answers_[next_answer_];
  next_answer_ = (next_answer_ + 1) % kOpenAnswers;
  if (answer.open && !answer.overdue) port.count(Counter::kMissingTransmitStamp);
  answer = Answer{true, true, false, id, header.correction};
  port.send(message, Destination::kNeighbour, Counter::kPdelayRespSent, actions);
}

/// The open request that this answers.
PeerDelay::Exchange* PeerDelay::asked(std::uint16_t sequence_id, const PortIdentity& requester,
                                      Port& port) noexcept {
  if (requester != port.identity()) {
    port.count(Counter::kWrongRequestingPort);
    return nullptr;
  }
  // A closed one is remembered: a second port may answer after the first one.
  if (!running_ || exchange_.sequence_id != sequence_id) {
    port.count(Counter::kStalePdelayResp);
    return nullptr;
  }
  return &exchange_;
}

void PeerDelay::on_response(const Header& header, const PdelayResp& response,
                            FreeRunningTime received, Port& port, ActionList& actions) noexcept {
  Exchange* const exchange = asked(header.sequence_id, response.requesting_port, port);
  if (exchange == nullptr) return;
  if (exchange->answered) {
    if (header.source == exchange->responder) {
      // Two answers with different stamps, to two copies of the request: which of them the
      // Follow_Up belongs to, nobody can tell.
      if (response.request_receipt != exchange->request_receipt ||
          header.correction != exchange->correction) {
        exchange->open = false;
      }
      return port.count(Counter::kStalePdelayResp);
    }
    port.count(Counter::kSeveralResponders);
    exchange->several = true;
    exchange->open = false;
    suspicious_ = kRequestsUntilTrusted;
    return;
  }
  if (!exchange->open) return port.count(Counter::kStalePdelayResp);
  port.count(Counter::kPdelayRespReceived);
  losses_ = 0;
  exchange->answered = true;
  exchange->two_step = header.has(flag::kTwoStep);
  exchange->responder = header.source;
  exchange->t4 = received;
  exchange->request_receipt = response.request_receipt;
  exchange->correction = header.correction;
  complete_if_ready(port, actions);
}

void PeerDelay::on_follow_up(const Header& header, const PdelayRespFollowUp& follow_up, Port& port,
                             ActionList& actions) noexcept {
  Exchange* const exchange = asked(header.sequence_id, follow_up.requesting_port, port);
  if (exchange == nullptr) return;
  if (exchange->answered && header.source != exchange->responder) {
    return port.count(Counter::kWrongPeer);
  }
  if (!exchange->open || exchange->followed_up) return port.count(Counter::kStalePdelayResp);
  port.count(Counter::kPdelayRespFollowUpReceived);
  exchange->followed_up = true;
  exchange->follower = header.source;
  exchange->response_origin = follow_up.response_origin;
  exchange->follow_up_correction = header.correction;
  complete_if_ready(port, actions);
}

void PeerDelay::on_sent(const EventId& id, FreeRunningTime sent, Port& port,
                        ActionList& actions) noexcept {
  if (id.type == MessageType::kPdelayReq) {
    if (!exchange_.open || exchange_.sent || exchange_.sequence_id != id.sequence_id) {
      return port.count(Counter::kUnexpectedTransmitStamp);
    }
    exchange_.sent = true;
    exchange_.t1 = sent;
    return complete_if_ready(port, actions);
  }
  Answer* const answer = find_answer(id);
  if (answer == nullptr) return port.count(Counter::kUnexpectedTransmitStamp);
  Message message{port.header(id.sequence_id, kNoLogInterval),
                  PdelayRespFollowUp{on_wire(sent), id.requester}};
  message.header.correction = answer->correction + fraction_of(on_wire(sent));
  answer->open = false;
  port.send(message, Destination::kNeighbour, Counter::kPdelayRespFollowUpSent, actions);
}

void PeerDelay::on_stamp_missing(const EventId& id, Port& port) noexcept {
  bool* overdue = nullptr;
  if (id.type == MessageType::kPdelayReq) {
    const bool awaited =
        exchange_.open && !exchange_.sent && exchange_.sequence_id == id.sequence_id;
    if (awaited) overdue = &exchange_.overdue;
  } else if (Answer* const answer = find_answer(id)) {
    overdue = &answer->overdue;
  }
  const bool news = overdue != nullptr && !*overdue;
  port.count(news ? Counter::kMissingTransmitStamp : Counter::kUnexpectedTransmitStamp);
  if (news) *overdue = true;
}

PeerDelay::Answer* PeerDelay::find_answer(const EventId& id) noexcept {
  auto* const found = std::ranges::find_if(
      answers_, [&](const Answer& answer) { return answer.open && answer.id == id; });
  return found == answers_.end() ? nullptr : found;
}

void PeerDelay::complete_if_ready(Port& port, ActionList& actions) noexcept {
  Exchange& exchange = exchange_;
  if (!exchange.open || !exchange.answered) return;
  if (exchange.followed_up && exchange.follower != exchange.responder) {
    exchange.followed_up = false;  // it came before the answer, from somebody else
    port.count(Counter::kWrongPeer);
  }
  if (!exchange.sent || (exchange.two_step && !exchange.followed_up)) return;
  exchange.open = false;
  if (exchange.responder != neighbour_) {  // another port at the other end of the cable
    neighbour_ = exchange.responder;
    forget_rate();
    measured_ = false;
  }
  measure_rate(port);
  Duration turn_around = exchange.correction;
  if (exchange.two_step) {
    turn_around +=
        exchange.follow_up_correction + (exchange.response_origin - exchange.request_receipt);
  }
  const Duration delay = (scale(exchange.t4 - exchange.t1, rate_ratio_) - turn_around).half();
  if (abs(delay) > Duration{kMaximumPeerDelay}) return port.count(Counter::kAbsurdPeerDelay);
  if (suspicious_ > 0) return;
  port.count(Counter::kPeerDelays);
  port.push(EmitPeerDelay{scale(delay, reference_rate_), rate_ratio_, !measured_, stamps()},
            actions);
  measured_ = true;
  mean_link_delay_ = delay;
}

/// Both references get the asymmetry, as those of Sync and Delay_Req do (TimeReceiver::emit).
std::optional<PeerStamps> PeerDelay::stamps() const noexcept {
  const Exchange& exchange = exchange_;
  // A one-step answer tells the turn-around alone, and so may a two-step one: both stamps are zero.
  const bool told = exchange.two_step && exchange.request_receipt != ReferenceTime{} &&
                    exchange.response_origin != ReferenceTime{};
  // A fraction of a nanosecond belongs to the stamp. More was added on the way, and the two fields
  // do not tell which of the messages it held up.
  const Duration fraction{Nanoseconds{1}};
  const bool direct =
      abs(exchange.correction) < fraction && abs(exchange.follow_up_correction) < fraction;
  if (!told || !direct || transmitter_ != exchange.responder) return std::nullopt;
  const ReferenceTime t2 = exchange.request_receipt - exchange.correction + config_.asymmetry;
  const ReferenceTime t3 =
      exchange.response_origin + exchange.follow_up_correction + config_.asymmetry;
  return PeerStamps{{Direction::kBackward, t2, exchange.t1},
                    {Direction::kForward, t3, exchange.t4}};
}

/// 802.1AS-2020, 11.2.19.3.3: how far t3 and t4 advanced from the oldest answer kept to this one.
void PeerDelay::measure_rate(Port& port) noexcept {
  // A one-step answer, and a two-step one that tells the difference alone, have no t3.
  if (!exchange_.two_step || exchange_.response_origin == ReferenceTime{}) return;
  const Instant newest{
      exchange_.response_origin + exchange_.correction + exchange_.follow_up_correction,
      exchange_.t4};
  if (instant_count_ > 0) {
    const Instant& oldest = instants_[instant_count_ < kInstants ? 0 : next_instant_];
    const double ours = (newest.ours - oldest.ours).ns();
    const double gained = (newest.neighbour - oldest.neighbour).ns() - ours;
    if (ours <= 0.0 ||
        std::abs(gained) > kLargestRateDeviation * std::max(ours, kShortestBaselineNs)) {
      port.count(Counter::kPeerRateRestarts);
      forget_rate();
    } else if (ours >= kShortestBaselineNs) {
      rate_ratio_ = Rate::from_ratio(1.0 + gained / ours);
      rate_known_ = true;
    }
  }
  const std::size_t last = (next_instant_ + kInstants - 1) % kInstants;
  if (instant_count_ > 0 && newest.ours - instants_[last].ours < kInstantSpacing) return;
  instants_[next_instant_] = newest;
  next_instant_ = (next_instant_ + 1) % kInstants;
  instant_count_ = std::min(instant_count_ + 1, kInstants);
}

void PeerDelay::forget_rate() noexcept {
  instant_count_ = 0;
  next_instant_ = 0;
  rate_ratio_ = Rate{};
  rate_known_ = false;
}

bool PeerDelay::capable() const noexcept {
  if (!config_.capability_needed) return true;
  return running_ && measured_ && rate_known_ && losses_ <= config_.allowed_losses &&
         suspicious_ == 0 && mean_link_delay_ >= Duration{config_.lowest} &&
         mean_link_delay_ <= Duration{config_.highest};
}

std::optional<Duration> PeerDelay::mean_link_delay() const noexcept {
  if (!measured_) return std::nullopt;
  return mean_link_delay_;
}

}  // namespace ftcs::ptp
