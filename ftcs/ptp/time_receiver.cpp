// SPDX-License-Identifier: MIT
#include "ftcs/ptp/time_receiver.h"

#include <variant>

#include "ftcs/ptp/interval.h"

namespace ftcs::ptp {
namespace {

/// 9.3.2.5: a data set that has come this far is worth nothing.
constexpr std::uint16_t kMaximumStepsRemoved = 255;

/// 11.3.2: every Delay_Resp takes the fraction of its stamp off the correction. That is no finding.
constexpr Duration kUsualNegativeCorrection{Nanoseconds{-1}};

bool same_reference(const TransmitterData& a, const TransmitterData& b) noexcept {
  return a.port == b.port && a.announce.grandmaster == b.announce.grandmaster;
}

}  // namespace

TimeReceiver::TimeReceiver(const Config& config) noexcept
    : config_(config), delay_requests_(config.log_min_delay_req_interval, config.seed) {}

ActionList TimeReceiver::start(FreeRunningTime) noexcept {
  ActionList actions;
  if (state_ == PortState::kInitializing) {
    change_state(PortState::kListening, PortEvent::kInitComplete, actions);
  }
  return actions;
}

ActionList TimeReceiver::on_event_message(std::span<const std::uint8_t> bytes,
                                          FreeRunningTime received, FreeRunningTime now) noexcept {
  ActionList actions;
  handle(bytes, Input{received, now}, actions);
  return actions;
}

ActionList TimeReceiver::on_general_message(std::span<const std::uint8_t> bytes,
                                            FreeRunningTime now) noexcept {
  ActionList actions;
  handle(bytes, Input{std::nullopt, now}, actions);
  return actions;
}

ActionList TimeReceiver::on_transmit_timestamp(std::uint16_t sequence_id, FreeRunningTime sent,
                                               FreeRunningTime now) noexcept {
  ActionList actions;
  emit(delay_requests_.on_sent(sequence_id, sent, counters_), now, actions);
  return actions;
}

ActionList TimeReceiver::on_transmit_timestamp_missing(std::uint16_t sequence_id,
                                                       FreeRunningTime) noexcept {
  delay_requests_.on_stamp_missing(sequence_id, counters_);
  return {};
}

ActionList TimeReceiver::on_timer(FreeRunningTime now) noexcept {
  ActionList actions;
  const auto timeout = has_transmitter_ ? foreign_.receipt_timeout(transmitter_.port,
                                                                   config_.announce_receipt_timeout)
                                        : std::nullopt;
  if (timeout && now >= *timeout) {
    counters_.add(Counter::kAnnounceTimeouts);
    foreign_.forget(transmitter_.port);
    has_transmitter_ = false;
    forget_exchanges();
    change_state(PortState::kListening, PortEvent::kAnnounceReceiptTimeoutExpires, actions);
    decide(now, actions);
  }
  send_delay_req_if_due(now, actions);
  return actions;
}

ActionList TimeReceiver::on_link_down(FreeRunningTime) noexcept {
  ActionList actions;
  if (state_ == PortState::kFaulty || state_ == PortState::kInitializing) return actions;
  counters_.add(Counter::kLinkDown);
  foreign_.clear();
  has_transmitter_ = false;
  forget_exchanges();
  change_state(PortState::kFaulty, PortEvent::kFaultDetected, actions);
  return actions;
}

ActionList TimeReceiver::on_link_up(FreeRunningTime) noexcept {
  ActionList actions;
  if (state_ == PortState::kFaulty) {
    change_state(PortState::kListening, PortEvent::kInitComplete, actions);
  }
  return actions;
}

ActionList TimeReceiver::on_servo_locked(FreeRunningTime) noexcept {
  ActionList actions;
  servo_locked_ = true;
  if (state_ == PortState::kUncalibrated) {
    change_state(PortState::kTimeReceiver, PortEvent::kTransmitterClockSelected, actions);
  }
  return actions;
}

ActionList TimeReceiver::on_servo_unlocked(FreeRunningTime) noexcept {
  ActionList actions;
  servo_locked_ = false;
  if (state_ == PortState::kTimeReceiver) {
    change_state(PortState::kUncalibrated, PortEvent::kSynchronizationFault, actions);
  }
  return actions;
}

std::optional<FreeRunningTime> TimeReceiver::deadline() const noexcept {
  if (!has_transmitter_) return std::nullopt;
  const auto timeout =
      foreign_.receipt_timeout(transmitter_.port, config_.announce_receipt_timeout);
  const auto request = delay_requests_.deadline();
  if (!timeout || !request) return timeout ? timeout : request;
  return *timeout < *request ? timeout : request;
}

const TransmitterData* TimeReceiver::transmitter() const noexcept {
  return has_transmitter_ ? &transmitter_ : nullptr;
}

void TimeReceiver::handle(std::span<const std::uint8_t> bytes, const Input& input,
                          ActionList& actions) noexcept {
  if (state_ == PortState::kInitializing || state_ == PortState::kFaulty) {
    counters_.add(Counter::kNotListening);
    return;
  }
  const auto message = decode(bytes);
  if (!message) {
    counters_.add(counter_of(message.error().reason));
    return;
  }
  if (is_for_us(message->header)) dispatch(*message, input, actions);
}

bool TimeReceiver::is_for_us(const Header& header) noexcept {
  if (header.major_sdo_id != config_.major_sdo_id) {
    counters_.add(Counter::kWrongSdo);
  } else if (header.domain != config_.domain) {
    counters_.add(Counter::kWrongDomain);
  } else if (header.source == config_.port) {
    counters_.add(Counter::kOwnMessage);
  } else if (header.has(flag::kAlternateTransmitter)) {
    counters_.add(Counter::kAlternateTransmitter);
  } else {
    return true;
  }
  return false;
}

void TimeReceiver::dispatch(const Message& message, const Input& input,
                            ActionList& actions) noexcept {
  switch (type_of(message.body)) {
    case MessageType::kAnnounce:
      return on_announce(message.header, *std::get_if<Announce>(&message.body), input.now, actions);
    case MessageType::kSync:
      return on_sync(message.header, *std::get_if<Sync>(&message.body), input, actions);
    case MessageType::kFollowUp:
      return on_follow_up(message.header, *std::get_if<FollowUp>(&message.body), input.now,
                          actions);
    case MessageType::kDelayResp:
      return on_delay_resp(message.header, *std::get_if<DelayResp>(&message.body), input.now,
                           actions);
    case MessageType::kDelayReq:
      return counters_.add(Counter::kNotForThisRole);
    case MessageType::kPdelayReq:
    case MessageType::kPdelayResp:
    case MessageType::kPdelayRespFollowUp:
      return counters_.add(Counter::kPdelayIgnored);
    case MessageType::kSignaling:
      return counters_.add(Counter::kSignalingIgnored);
    case MessageType::kManagement:
      return counters_.add(Counter::kManagementIgnored);
  }
}

bool TimeReceiver::from_transmitter(const Header& header) noexcept {
  if (!has_transmitter_) {
    counters_.add(Counter::kNotListening);
    return false;
  }
  if (header.source != transmitter_.port) {
    counters_.add(Counter::kWrongTransmitter);
    return false;
  }
  return true;
}

bool TimeReceiver::usable_correction(const Header& header) noexcept {
  if (abs(header.correction) > Duration{kMaximumCorrection}) {
    counters_.add(Counter::kAbsurdCorrection);
    return false;
  }
  if (header.correction < kUsualNegativeCorrection) counters_.add(Counter::kNegativeCorrection);
  return true;
}

void TimeReceiver::on_announce(const Header& header, const Announce& announce, FreeRunningTime now,
                               ActionList& actions) noexcept {
  if (announce.steps_removed >= kMaximumStepsRemoved || header.source.clock == config_.port.clock ||
      announce.grandmaster == config_.port.clock) {
    counters_.add(Counter::kUnusableAnnounce);
    return;
  }
  counters_.add(Counter::kAnnounceReceived);
  auto interval = interval_from_log(header.log_interval);
  if (!interval) {
    if (header.log_interval != kNoLogInterval) counters_.add(Counter::kBadInterval);
    interval = interval_from_log(config_.log_announce_interval);
  }
  TransmitterData data{header.source, announce, header.flags};
  data.announce.origin = {};  // differs in each message and says nothing about the transmitter
  const auto heard = foreign_.hear(data, interval.value_or(Duration{std::chrono::seconds{1}}), now,
                                   has_transmitter_ ? transmitter_.port : PortIdentity{});
  if (heard == ForeignTransmitters::Heard::kTableFull) counters_.add(Counter::kForeignTableFull);
  if (heard == ForeignTransmitters::Heard::kNew) push(TransmitterSeen{header.source}, actions);
  decide(now, actions);
}

void TimeReceiver::on_sync(const Header& header, const Sync& sync, const Input& input,
                           ActionList& actions) noexcept {
  if (!input.received) return counters_.add(Counter::kWrongChannel);
  if (!from_transmitter(header) || !usable_correction(header)) return;
  counters_.add(Counter::kSyncReceived);
  if (const auto interval = interval_from_log(header.log_interval)) sync_interval_ = interval;
  emit(matcher_.on_sync(header, sync, *input.received, input.now, counters_), input.now, actions);
  if (!delay_requests_.running()) delay_requests_.start(input.now);
  send_delay_req_if_due(input.now, actions);
}

void TimeReceiver::on_follow_up(const Header& header, const FollowUp& follow_up,
                                FreeRunningTime now, ActionList& actions) noexcept {
  if (!from_transmitter(header) || !usable_correction(header)) return;
  counters_.add(Counter::kFollowUpReceived);
  emit(matcher_.on_follow_up(header, follow_up, now, counters_), now, actions);
}

void TimeReceiver::on_delay_resp(const Header& header, const DelayResp& response,
                                 FreeRunningTime now, ActionList& actions) noexcept {
  if (!from_transmitter(header)) return;
  if (response.requesting_port != config_.port) {
    counters_.add(Counter::kWrongRequestingPort);
    return;
  }
  if (!usable_correction(header)) return;
  counters_.add(Counter::kDelayRespReceived);
  delay_requests_.honour(header.log_interval, now, counters_);
  emit(delay_requests_.on_response(header, response, counters_), now, actions);
}

/// State decision (9.3.3) of a clock that never transmits: follow the best, if there is one.
void TimeReceiver::decide(FreeRunningTime now, ActionList& actions) noexcept {
  const PortIdentity selected = has_transmitter_ ? transmitter_.port : PortIdentity{};
  const TransmitterData* const best = foreign_.best(selected, now);
  if (best == nullptr || (has_transmitter_ && *best == transmitter_)) return;
  select(*best, actions);
}

void TimeReceiver::select(const TransmitterData& data, ActionList& actions) noexcept {
  const bool same_port = has_transmitter_ && transmitter_.port == data.port;
  const bool changed = !had_transmitter_ || !same_reference(data, transmitter_);
  transmitter_ = data;
  has_transmitter_ = true;
  had_transmitter_ = true;
  if (changed) {
    counters_.add(Counter::kTransmitterChanges);
    servo_locked_ = false;  // locked to something else
  }
  push(TransmitterSelected{data, changed}, actions);
  if (same_port) return;
  forget_exchanges();
  if (state_ != PortState::kUncalibrated) {
    change_state(PortState::kUncalibrated, PortEvent::kRecommendedReceiver, actions);
  }
}

void TimeReceiver::send_delay_req_if_due(FreeRunningTime now, ActionList& actions) noexcept {
  const auto sequence_id = delay_requests_.begin_if_due(now, counters_);
  if (!sequence_id) return;
  Message message;
  message.header.major_sdo_id = config_.major_sdo_id;
  message.header.minor_version = config_.minor_version;
  message.header.domain = config_.domain;
  message.header.flags = config_.unicast ? flag::kUnicast : std::uint16_t{0};
  message.header.source = config_.port;
  message.header.sequence_id = *sequence_id;
  message.body = DelayReq{};  // 11.3.2: origin zero, as we have no time to tell
  const auto bytes = encode(message);
  if (!bytes) return counters_.add(Counter::kUnusableTime);
  counters_.add(Counter::kDelayReqSent);
  push(SendMessage{Channel::kEvent, config_.unicast ? Destination::kPeer : Destination::kMulticast,
                   MessageType::kDelayReq, *sequence_id, *bytes},
       actions);
}

void TimeReceiver::emit(std::optional<EventPair> pair, FreeRunningTime now,
                        ActionList& actions) noexcept {
  if (!pair) return;
  // t2 = t1 + (mean + asymmetry) + offset and t4 = t3 + (mean - asymmetry) - offset: added to both,
  // the mean remains.
  pair->reference = pair->reference + config_.delay_asymmetry;
  if (pair->direction == Direction::kForward) {
    counters_.add(Counter::kForwardPairs);
    check_for_jump(*pair, now, actions);
    if (servo_locked_ && state_ == PortState::kUncalibrated) {
      change_state(PortState::kTimeReceiver, PortEvent::kTransmitterClockSelected, actions);
    }
  } else {
    counters_.add(Counter::kBackwardPairs);
  }
  push(EmitPair{*pair}, actions);
}

void TimeReceiver::check_for_jump(const EventPair& forward, FreeRunningTime now,
                                  ActionList& actions) noexcept {
  const LastPair last = last_forward_;
  last_forward_ = LastPair{true, forward};
  if (!last.known) return;
  const Duration elapsed = forward.free_running - last.pair.free_running;
  const Duration jump = (forward.reference - last.pair.reference) - elapsed;
  const Duration tolerance = Duration{kJumpTolerance} + abs(elapsed).half().half().half();
  if (abs(jump) <= tolerance) return;
  counters_.add(Counter::kReferenceJumps);
  // A request from before the jump would be answered after it: half the jump would look like delay.
  if (delay_requests_.running()) delay_requests_.restart(now, counters_);
  push(ReferenceJumped{jump}, actions);
}

void TimeReceiver::forget_exchanges() noexcept {
  matcher_.reset();
  delay_requests_.stop(counters_);
  last_forward_ = LastPair{};
  sync_interval_.reset();
}

void TimeReceiver::change_state(PortState to, PortEvent event, ActionList& actions) noexcept {
  const PortState from = state_;
  state_ = to;
  push(PortStateChanged{from, to, event}, actions);
}

void TimeReceiver::push(const Action& action, ActionList& actions) noexcept {
  if (!actions.push(action)) counters_.add(Counter::kActionsDropped);
}

}  // namespace ftcs::ptp
