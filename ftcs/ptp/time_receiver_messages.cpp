// SPDX-License-Identifier: MIT
// What a time receiver does with each message; its inputs, states and timers are in
// time_receiver.cpp.
#include <algorithm>
#include <variant>

#include "ftcs/ptp/interval.h"
#include "ftcs/ptp/sequence.h"
#include "ftcs/ptp/time_receiver.h"

namespace ftcs::ptp {
namespace {

/// 9.3.2.5: a data set that has come this far is worth nothing.
constexpr std::uint16_t kMaximumStepsRemoved = 255;

/// IEEE 802.1AS alone defines the information in Follow_Up (10.6.2.2.1 there).
constexpr std::uint8_t kGptpSdoId = 1;

/// 7.5.2: no clock has such an identity, and no port such a number.
bool is_possible(const ClockIdentity& clock) noexcept {
  const auto all = [&clock](std::uint8_t octet) {
    return std::all_of(clock.octets.begin(), clock.octets.end(),
                       [octet](std::uint8_t one) { return one == octet; });
  };
  return !all(0x00) && !all(0xFF);
}

bool is_possible(const PortIdentity& port) noexcept {
  return is_possible(port.clock) && port.port != 0 && port.port != 0xFFFF;
}

/// 11.3.2: every Delay_Resp takes the fraction of its stamp off the correction. That is no finding.
constexpr Duration kUsualNegativeCorrection{Nanoseconds{-1}};

}  // namespace

/// Whether a message of time may come from there at all.
bool TimeReceiver::usable_source(const Header& header) noexcept {
  if (header.has(flag::kAlternateTransmitter)) {
    port_.count(Counter::kAlternateTransmitter);
  } else if (!config_.acceptable.accepts(header.source.clock)) {
    port_.count(Counter::kUnacceptableTransmitter);
  } else if (!peer_delay_.capable()) {
    port_.count(Counter::kNotCapable);
  } else {
    return true;
  }
  return false;
}

void TimeReceiver::dispatch(const Message& message, const Input& input,
                            ActionList& actions) noexcept {
  const Header& header = message.header;
  switch (type_of(message.body)) {
    case MessageType::kAnnounce:
      if (!usable_source(header)) return;
      return on_announce(header, *std::get_if<Announce>(&message.body), input.now, actions);
    case MessageType::kSync:
      if (!input.received) return port_.count(Counter::kWrongChannel);
      if (!from_transmitter(message, input.now)) return;
      return on_sync(header, *std::get_if<Sync>(&message.body), input, actions);
    case MessageType::kFollowUp:
      if (!from_transmitter(message, input.now)) return;
      return on_follow_up(header, *std::get_if<FollowUp>(&message.body), input.now, actions);
    case MessageType::kDelayResp:
      if (peer_to_peer()) return port_.count(Counter::kDelayIgnored);
      if (!from_transmitter(message, input.now)) return;
      return on_delay_resp(header, *std::get_if<DelayResp>(&message.body), input.now, actions);
    case MessageType::kDelayReq:
      return port_.count(Counter::kNotForThisRole);
    case MessageType::kPdelayReq:
    case MessageType::kPdelayResp:
    case MessageType::kPdelayRespFollowUp:
      return peer_delay_.on_message(message, input.received, port_, actions);
    case MessageType::kSignaling:
      return port_.count(Counter::kSignalingIgnored);
    case MessageType::kManagement:
      return port_.count(Counter::kManagementIgnored);
  }
}

/// Whether the message comes from the selected transmitter or, while there is none, from the
/// candidate of a fast start.
bool TimeReceiver::from_transmitter(const Message& message, FreeRunningTime now) noexcept {
  if (!usable_source(message.header)) return false;
  const PortIdentity& source = message.header.source;
  if (has_transmitter_) {
    if (source == transmitter_.port) return true;
    port_.count(Counter::kWrongTransmitter);
    return false;
  }
  if (config_.fast_start && std::holds_alternative<Sync>(message.body)) {
    const auto admission = fast_start_.admit_sync(source, now);
    if (admission.changed) forget_exchanges();
    if (admission.admitted) return true;
  } else if (fast_start_.is_candidate(source)) {
    return true;
  }
  port_.count(Counter::kNotListening);
  return false;
}

bool TimeReceiver::usable_correction(const Header& header) noexcept {
  if (abs(header.correction) > Duration{kMaximumCorrection}) {
    port_.count(Counter::kAbsurdCorrection);
    return false;
  }
  if (header.correction < kUsualNegativeCorrection) port_.count(Counter::kNegativeCorrection);
  return true;
}

/// What a transmitter announces is believed up to eight times our own interval, and once it has
/// been heard, up to twice the time between its Announces: two messages that promise the next one
/// in minutes must not bind us so long to who never speaks again.
Duration TimeReceiver::believed_interval(const Header& header, FreeRunningTime now) noexcept {
  const Duration own =
      interval_from_log(config_.log_announce_interval).value_or(Duration{std::chrono::seconds{1}});
  const auto announced = interval_from_log(header.log_interval);
  if (!announced) {
    if (header.log_interval != kNoLogInterval) port_.count(Counter::kBadInterval);
    return own;
  }
  constexpr int kLongestInOwn = 8;
  const Duration believed = std::min(*announced, multiply(own, kLongestInOwn));
  const auto last = foreign_.last_heard(header.source);
  return last ? std::min(believed, std::max(own, multiply(now - *last, 2))) : believed;
}

/// Of an authentic Sync or Follow_Up: that it is not a copy of an old one (16.14.4.3).
bool TimeReceiver::is_new(const Header& header, FreeRunningTime now) noexcept {
  const SecurityAssociation* const security = port_.security();
  if (security == nullptr || security->sequence_window == 0) return true;
  const bool found = sequence_window_.is_new(header.sequence_id, security->sequence_window,
                                             sync_interval_.value_or(Duration{}), now);
  if (!found) port_.count(Counter::kReplayed);
  return found;
}

/// Of an authentic Announce: old ones must neither select a transmitter nor keep one alive that is
/// silent, nor one with a number far ahead make the true ones old. From who misses more in a row
/// than the receipt timeout counts, or has been started again, nothing is heard until that timeout;
/// then every number is new.
bool TimeReceiver::is_new_announce(const Header& header, FreeRunningTime now) noexcept {
  const SecurityAssociation* const security = port_.security();
  if (security == nullptr || security->sequence_window == 0) return true;
  const auto last = foreign_.sequence_id(header.source);
  if (!last) return true;
  // The selected one is lost by the timer alone.
  const bool is_selected = has_transmitter_ && header.source == transmitter_.port;
  const auto timeout = foreign_.receipt_timeout(header.source, config_.announce_receipt_timeout);
  if (!is_selected && now >= *timeout) return true;
  const int ahead = sequence_distance(header.sequence_id, *last);
  const int width = std::max<int>(security->sequence_window, config_.announce_receipt_timeout);
  if (ahead > 0 && ahead <= width) return true;
  port_.count(Counter::kReplayed);
  return false;
}

void TimeReceiver::on_announce(const Header& header, const Announce& announce, FreeRunningTime now,
                               ActionList& actions) noexcept {
  if (announce.steps_removed >= kMaximumStepsRemoved || header.source.clock == config_.port.clock ||
      announce.grandmaster == config_.port.clock || !is_possible(header.source) ||
      !is_possible(announce.grandmaster)) {
    port_.count(Counter::kUnusableAnnounce);
    return;
  }
  if (!is_new_announce(header, now)) return;
  port_.count(Counter::kAnnounceReceived);
  const Duration interval = believed_interval(header, now);
  TransmitterData data{header.source, announce, header.flags};
  data.announce.origin = {};  // differs in each message and says nothing about the transmitter
  const auto heard =
      foreign_.hear(data, interval, now, has_transmitter_ ? transmitter_.port : PortIdentity{},
                    header.sequence_id);
  if (heard == ForeignTransmitters::Heard::kTableFull) port_.count(Counter::kForeignTableFull);
  if (heard == ForeignTransmitters::Heard::kNew)
    port_.push(TransmitterSeen{header.source}, actions);
  if (decide(now, actions)) return;
  // Who believes only what is said again has to hear it again.
  if (has_transmitter_ && transmitter_.port == header.source) {
    port_.push(TransmitterSelected{transmitter_, false}, actions);
  }
}

void TimeReceiver::on_sync(const Header& header, const Sync& sync, const Input& input,
                           ActionList& actions) noexcept {
  if (!usable_correction(header) || !is_new(header, input.now)) return;
  port_.count(Counter::kSyncReceived);
  last_sync_ = input.now;
  if (const auto interval = interval_from_log(header.log_interval)) sync_interval_ = interval;
  if (config_.hybrid) port_.push(SenderIsTransmitter{}, actions);
  const auto pair = matcher_.on_sync(header, sync, *input.received, input.now, port_.counters());
  if (emit(pair, input.now, actions)) sequence_window_.use(header.sequence_id, input.now);
  if (peer_to_peer()) return;
  if (!delay_requests_.running()) delay_requests_.start(input.now);
  send_delay_req_if_due(input.now, actions);
}

void TimeReceiver::on_follow_up(const Header& header, const FollowUp& follow_up,
                                FreeRunningTime now, ActionList& actions) noexcept {
  if (!usable_correction(header) || !is_new(header, now)) return;
  port_.count(Counter::kFollowUpReceived);
  const auto pair = matcher_.on_follow_up(header, follow_up, now, port_.counters());
  const bool informed = pair && config_.major_sdo_id == kGptpSdoId;
  if (informed && !believes_information(follow_up, now, actions)) return;
  if (emit(pair, now, actions)) sequence_window_.use(header.sequence_id, now);
}

/// 802.1AS-2020, 11.4.4.3: how fast the grandmaster is, by the sender's clock, by which the peer
/// delay was measured; and that its time base changed, however small the jump. That is believed
/// once ReferenceWatch::kAgreeing Follow_Ups in a row have said it, over kLeastSpan; until then
/// they tell no time.
bool TimeReceiver::believes_information(const FollowUp& follow_up, FreeRunningTime now,
                                        ActionList& actions) noexcept {
  if (!follow_up.has_information) return true;
  const std::uint16_t indicator = follow_up.information.gm_time_base_indicator;
  const bool changed = has_information_ && information_.gm_time_base_indicator != indicator;
  const bool again = changed && new_time_base_told_ > 0 && new_time_base_ == indicator;
  new_time_base_ = indicator;
  new_time_base_told_ = changed ? (again ? new_time_base_told_ + 1 : 1) : 0;
  if (new_time_base_told_ == 1) new_time_base_since_ = now;
  if (changed && (new_time_base_told_ < ReferenceWatch::kAgreeing ||
                  now - new_time_base_since_ < Duration{ReferenceWatch::kLeastSpan})) {
    port_.count(Counter::kDoubtedTime);
    return false;
  }
  new_time_base_told_ = 0;
  has_information_ = true;
  information_ = follow_up.information;
  peer_delay_.set_reference_rate(Rate::from_ratio(1.0 + information_.cumulative_rate_offset()));
  if (!changed || !has_transmitter_) return true;
  port_.count(Counter::kReferenceJumps);
  reference_.reset();  // the jump is known: it need not be found again
  port_.push(ReferenceJumped{information_.last_gm_phase_change}, actions);
  return true;
}

void TimeReceiver::on_delay_resp(const Header& header, const DelayResp& response,
                                 FreeRunningTime now, ActionList& actions) noexcept {
  if (response.requesting_port != config_.port) return port_.count(Counter::kWrongRequestingPort);
  if (!usable_correction(header)) return;
  port_.count(Counter::kDelayRespReceived);
  emit(delay_requests_.on_response(header, response, now, port_.counters()), now, actions);
}

}  // namespace ftcs::ptp
