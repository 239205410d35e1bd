// SPDX-License-Identifier: MIT
#include "ftcs/ptp/time_receiver.h"

#include <algorithm>
#include <utility>

#include "ftcs/ptp/interval.h"

namespace ftcs::ptp {
namespace {

bool same_reference(const TransmitterData& a, const TransmitterData& b) noexcept {
  return a.port == b.port && a.announce.grandmaster == b.announce.grandmaster;
}

PortConfig port_config(const TimeReceiverConfig& config) noexcept {
  return {config.port,    config.domain,          config.major_sdo_id, config.minor_version,
          config.unicast, config.assume_two_step, config.security};
}

PeerDelayConfig peer_delay_config(const TimeReceiverConfig& config) noexcept {
  PeerDelayConfig peer_delay = config.peer_delay;
  peer_delay.asymmetry = config.delay_asymmetry;
  return peer_delay;
}

/// The earlier one of two times that may be unknown.
std::optional<FreeRunningTime> earlier(std::optional<FreeRunningTime> a,
                                       std::optional<FreeRunningTime> b) noexcept {
  if (!a || !b) return a ? a : b;
  return std::min(*a, *b);
}

}  // namespace

TimeReceiver::TimeReceiver(const Config& config) noexcept
    : config_(config),
      port_(port_config(config)),
      peer_delay_(peer_delay_config(config)),
      delay_requests_(config.log_min_delay_req_interval, config.seed, config.first_request_id) {}

ActionList TimeReceiver::start(FreeRunningTime now) noexcept {
  ActionList actions;
  if (port_.state() != PortState::kInitializing) return actions;
  if (peer_to_peer()) peer_delay_.start(now);
  port_.change_state(PortState::kListening, PortEvent::kInitComplete, actions);
  return actions;
}

ActionList TimeReceiver::on_event_message(std::span<const std::uint8_t> bytes,
                                          FreeRunningTime received, FreeRunningTime now) noexcept {
  ActionList actions;
  if (const auto message = port_.read(bytes)) dispatch(*message, Input{received, now}, actions);
  return actions;
}

ActionList TimeReceiver::on_general_message(std::span<const std::uint8_t> bytes,
                                            FreeRunningTime now) noexcept {
  ActionList actions;
  if (const auto message = port_.read(bytes)) dispatch(*message, Input{std::nullopt, now}, actions);
  return actions;
}

ActionList TimeReceiver::on_transmit_timestamp(const EventId& id, FreeRunningTime sent,
                                               FreeRunningTime now) noexcept {
  ActionList actions;
  if (id.type == MessageType::kDelayReq) {
    emit(delay_requests_.on_sent(id.sequence_id, sent, port_.counters()), now, actions);
  } else {
    peer_delay_.on_sent(id, sent, port_, actions);
  }
  return actions;
}

ActionList TimeReceiver::on_transmit_timestamp_missing(const EventId& id,
                                                       FreeRunningTime) noexcept {
  if (id.type == MessageType::kDelayReq) {
    delay_requests_.on_stamp_missing(id.sequence_id, port_.counters());
  } else {
    peer_delay_.on_stamp_missing(id, port_);
  }
  return {};
}

ActionList TimeReceiver::on_timer(FreeRunningTime now) noexcept {
  ActionList actions;
  const auto timeout = has_transmitter_ ? foreign_.receipt_timeout(transmitter_.port,
                                                                   config_.announce_receipt_timeout)
                                        : std::nullopt;
  const auto silence = sync_timeout();
  if (timeout && now >= *timeout) {
    lose_transmitter(Counter::kAnnounceTimeouts, now, actions);
  } else if (silence && now >= *silence) {
    lose_transmitter(Counter::kSyncTimeouts, now, actions);
  }
  peer_delay_.on_timer(now, port_, actions);
  send_delay_req_if_due(now, actions);
  return actions;
}

void TimeReceiver::lose_transmitter(Counter reason, FreeRunningTime now,
                                    ActionList& actions) noexcept {
  port_.count(reason);
  foreign_.forget(transmitter_.port);
  has_transmitter_ = false;
  forget_exchanges();
  port_.change_state(PortState::kListening, PortEvent::kAnnounceReceiptTimeoutExpires, actions);
  decide(now, actions);
}

std::optional<FreeRunningTime> TimeReceiver::sync_timeout() const noexcept {
  if (!has_transmitter_ || config_.sync_receipt_timeout == 0 || !sync_interval_) {
    return std::nullopt;
  }
  return last_sync_ + multiply(*sync_interval_, config_.sync_receipt_timeout);
}

ActionList TimeReceiver::on_link_down(FreeRunningTime) noexcept {
  ActionList actions;
  if (!port_.is_active()) return actions;
  port_.count(Counter::kLinkDown);
  foreign_.clear();
  fast_start_.clear();
  peer_delay_.stop();
  has_transmitter_ = false;
  forget_exchanges();
  port_.change_state(PortState::kFaulty, PortEvent::kFaultDetected, actions);
  return actions;
}

ActionList TimeReceiver::on_link_up(FreeRunningTime now) noexcept {
  ActionList actions;
  if (port_.state() != PortState::kFaulty) return actions;
  if (peer_to_peer()) peer_delay_.start(now);
  port_.change_state(PortState::kListening, PortEvent::kInitComplete, actions);
  return actions;
}

ActionList TimeReceiver::on_servo_locked(FreeRunningTime) noexcept {
  ActionList actions;
  servo_locked_ = true;
  if (port_.state() == PortState::kUncalibrated) {
    port_.change_state(PortState::kTimeReceiver, PortEvent::kTransmitterClockSelected, actions);
  }
  return actions;
}

ActionList TimeReceiver::on_servo_unlocked(FreeRunningTime) noexcept {
  ActionList actions;
  servo_locked_ = false;
  if (port_.state() == PortState::kTimeReceiver) {
    port_.change_state(PortState::kUncalibrated, PortEvent::kSynchronizationFault, actions);
  }
  return actions;
}

ActionList TimeReceiver::on_transmitter_doubted(FreeRunningTime now) noexcept {
  ActionList actions;
  if (!has_transmitter_) return actions;
  if (!foreign_.doubt(transmitter_.port, now)) return actions;
  port_.count(Counter::kDoubtedTransmitters);
  port_.push(TransmitterDoubted{transmitter_.port}, actions);
  decide(now, actions);
  return actions;
}

std::optional<FreeRunningTime> TimeReceiver::deadline() const noexcept {
  auto next = earlier(delay_requests_.deadline(), peer_delay_.deadline());
  if (!has_transmitter_) return next;
  next =
      earlier(next, foreign_.receipt_timeout(transmitter_.port, config_.announce_receipt_timeout));
  return earlier(next, sync_timeout());
}

const TransmitterData* TimeReceiver::transmitter() const noexcept {
  return has_transmitter_ ? &transmitter_ : nullptr;
}

std::optional<Rate> TimeReceiver::grandmaster_rate_ratio() const noexcept {
  if (!has_information_) return std::nullopt;
  return Rate::from_ratio(1.0 + information_.cumulative_rate_offset()) *
         peer_delay_.neighbor_rate_ratio();
}

/// State decision (9.3.3) of a clock that never transmits: follow the best, if there is one.
/// True if what it follows, or what that says of itself, is another than before.
bool TimeReceiver::decide(FreeRunningTime now, ActionList& actions) noexcept {
  const PortIdentity selected = has_transmitter_ ? transmitter_.port : PortIdentity{};
  const bool first_suffices = config_.fast_start && !has_transmitter_;
  const TransmitterData* const best = foreign_.best(selected, now, first_suffices);
  if (best == nullptr || (has_transmitter_ && *best == transmitter_)) return false;
  select(*best, now, actions);
  return true;
}

void TimeReceiver::select(const TransmitterData& data, FreeRunningTime now,
                          ActionList& actions) noexcept {
  const bool same_port = has_transmitter_ && transmitter_.port == data.port;
  const bool measured = !has_transmitter_ && fast_start_.is_candidate(data.port);
  const bool changed = !had_transmitter_ || !same_reference(data, transmitter_);
  transmitter_ = data;
  has_transmitter_ = true;
  if (changed) {
    if (had_transmitter_) port_.count(Counter::kTransmitterChanges);
    servo_locked_ = false;  // locked to something else
  }
  had_transmitter_ = true;
  port_.push(TransmitterSelected{data, changed}, actions);
  if (untold_jump_)
    port_.push(ReferenceJumped{*std::exchange(untold_jump_, std::nullopt)}, actions);
  if (same_port) return;
  if (!measured) forget_exchanges();
  if (config_.major_sdo_id == 0) peer_delay_.set_transmitter(data.port);
  last_sync_ = now;
  if (port_.state() != PortState::kUncalibrated) {
    port_.change_state(PortState::kUncalibrated, PortEvent::kRecommendedReceiver, actions);
  }
  if (measured) {
    for (const EventPair& pair : fast_start_) deliver(pair, actions);
  }
  fast_start_.clear();
}

void TimeReceiver::deliver(const EventPair& pair, ActionList& actions) noexcept {
  port_.count(pair.direction == Direction::kForward ? Counter::kForwardPairs
                                                    : Counter::kBackwardPairs);
  port_.push(EmitPair{pair}, actions);
}

void TimeReceiver::send_delay_req_if_due(FreeRunningTime now, ActionList& actions) noexcept {
  const auto sequence_id = delay_requests_.begin_if_due(now, port_.counters());
  if (!sequence_id) return;
  // 11.3.2: origin zero, as we have no time to tell.
  Message message{port_.header(*sequence_id, kNoLogInterval), DelayReq{}};
  if (config_.hybrid) message.header.flags |= flag::kUnicast;
  port_.send(message, config_.hybrid ? Destination::kTransmitter : Destination::kMulticast,
             Counter::kDelayReqSent, actions);
}

/// True if the pair is believed.
bool TimeReceiver::emit(std::optional<EventPair> pair, FreeRunningTime now,
                        ActionList& actions) noexcept {
  if (!pair) return false;
  // t2 = t1 + (mean + asymmetry) + offset and t4 = t3 + (mean - asymmetry) - offset: added to both,
  // the mean remains.
  pair->reference = pair->reference + config_.delay_asymmetry;
  if (!believes(*pair, now, actions)) return false;
  if (!has_transmitter_) {
    fast_start_.keep(*pair);
    return true;
  }
  if (pair->direction == Direction::kForward && servo_locked_ &&
      port_.state() == PortState::kUncalibrated) {
    port_.change_state(PortState::kTimeReceiver, PortEvent::kTransmitterClockSelected, actions);
  }
  deliver(*pair, actions);
  return true;
}

/// Whether the pair tells the time as those before it, or one that was told often enough.
bool TimeReceiver::believes(const EventPair& pair, FreeRunningTime now,
                            ActionList& actions) noexcept {
  ReferenceWatch::Finding found;
  if (pair.direction == Direction::kForward) {
    found = reference_.on_sync(pair);
  } else if (!reference_.goes_on(pair)) {
    found.verdict = ReferenceWatch::Verdict::kDoubted;
  }
  if (found.verdict == ReferenceWatch::Verdict::kDoubted) {
    port_.count(Counter::kDoubtedTime);
    return false;
  }
  if (found.verdict == ReferenceWatch::Verdict::kJumped) follow_jump(found.jump, now, actions);
  return true;
}

void TimeReceiver::follow_jump(Duration jump, FreeRunningTime now, ActionList& actions) noexcept {
  port_.count(Counter::kReferenceJumps);
  // A request from before the jump would be answered after it: half the jump would look like delay.
  if (delay_requests_.running()) delay_requests_.restart(now, port_.counters());
  peer_delay_.abandon_exchange();
  fast_start_.forget_pairs();
  if (has_transmitter_) {
    port_.push(ReferenceJumped{jump}, actions);
  } else if (had_transmitter_) {
    untold_jump_ = untold_jump_.value_or(Duration{}) + jump;
  }
}

// What the reference showed is remembered: another transmitter that tells another time, or the
// first message after a change, is believed as any jump is.
void TimeReceiver::forget_exchanges() noexcept {
  matcher_.reset();
  sequence_window_.reset();
  delay_requests_.stop(port_.counters());
  has_information_ = false;
  new_time_base_told_ = 0;
  peer_delay_.set_reference_rate(Rate{});
  peer_delay_.set_transmitter(std::nullopt);
  sync_interval_.reset();
}

}  // namespace ftcs::ptp
