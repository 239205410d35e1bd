// SPDX-License-Identifier: MIT
#include "ftcs/ptp/time_transmitter.h"

#include <chrono>
#include <variant>

#include "ftcs/ptp/interval.h"
#include "ftcs/ptp/wire/fields.h"

namespace ftcs::ptp {
namespace {

Duration interval_or_second(std::int8_t log_interval) noexcept {
  return interval_from_log(log_interval).value_or(Duration{std::chrono::seconds{1}});
}

/// The next time of a regular schedule; what was slept through is left out instead of being sent in
/// a burst.
FreeRunningTime after(FreeRunningTime due, Duration interval, FreeRunningTime now) noexcept {
  const FreeRunningTime next = due + interval;
  return next > now ? next : now + interval;
}

}  // namespace

TimeTransmitter::TimeTransmitter(const Config& config) noexcept
    : config_(config),
      announce_interval_(interval_or_second(config.log_announce_interval)),
      sync_interval_(interval_or_second(config.log_sync_interval)) {}

ActionList TimeTransmitter::start(FreeRunningTime now) noexcept {
  ActionList actions;
  if (state_ == PortState::kInitializing) begin_transmitting(now, actions);
  return actions;
}

ActionList TimeTransmitter::on_event_message(std::span<const std::uint8_t> bytes,
                                             ReferenceTime received, FreeRunningTime) noexcept {
  ActionList actions;
  handle(bytes, received, actions);
  return actions;
}

ActionList TimeTransmitter::on_general_message(std::span<const std::uint8_t> bytes,
                                               FreeRunningTime) noexcept {
  ActionList actions;
  handle(bytes, std::nullopt, actions);
  return actions;
}

ActionList TimeTransmitter::on_transmit_timestamp(std::uint16_t sequence_id, ReferenceTime sent,
                                                  FreeRunningTime) noexcept {
  ActionList actions;
  OpenSync* const sync = find(sequence_id);
  if (sync == nullptr) {
    counters_.add(Counter::kUnexpectedTransmitStamp);
    return actions;
  }
  *sync = OpenSync{};
  Message message{header(sequence_id, config_.log_sync_interval), FollowUp{sent}};
  message.header.correction = fraction_of(sent);  // 9.5.10: what preciseOriginTimestamp cannot hold
  if (send(message, config_.unicast ? Destination::kPeer : Destination::kMulticast, actions)) {
    counters_.add(Counter::kFollowUpSent);
  }
  return actions;
}

ActionList TimeTransmitter::on_transmit_timestamp_missing(std::uint16_t sequence_id,
                                                          FreeRunningTime) noexcept {
  OpenSync* const sync = find(sequence_id);
  counters_.add(sync == nullptr ? Counter::kUnexpectedTransmitStamp
                                : Counter::kMissingTransmitStamp);
  if (sync != nullptr) *sync = OpenSync{};
  return {};
}

ActionList TimeTransmitter::on_timer(FreeRunningTime now) noexcept {
  ActionList actions;
  if (state_ != PortState::kTimeTransmitter) return actions;
  if (now >= next_announce_) {
    send_announce(actions);
    next_announce_ = after(next_announce_, announce_interval_, now);
  }
  if (now >= next_sync_) {
    send_sync(actions);
    next_sync_ = after(next_sync_, sync_interval_, now);
  }
  return actions;
}

ActionList TimeTransmitter::on_link_down(FreeRunningTime) noexcept {
  ActionList actions;
  if (state_ != PortState::kTimeTransmitter) return actions;
  counters_.add(Counter::kLinkDown);
  open_syncs_ = {};
  change_state(PortState::kFaulty, PortEvent::kFaultDetected, actions);
  return actions;
}

ActionList TimeTransmitter::on_link_up(FreeRunningTime now) noexcept {
  ActionList actions;
  if (state_ == PortState::kFaulty) begin_transmitting(now, actions);
  return actions;
}

std::optional<FreeRunningTime> TimeTransmitter::deadline() const noexcept {
  if (state_ != PortState::kTimeTransmitter) return std::nullopt;
  return next_announce_ < next_sync_ ? next_announce_ : next_sync_;
}

void TimeTransmitter::begin_transmitting(FreeRunningTime now, ActionList& actions) noexcept {
  change_state(PortState::kListening, PortEvent::kInitComplete, actions);
  change_state(PortState::kTimeTransmitter, PortEvent::kRecommendedTransmitter, actions);
  next_announce_ = now;
  next_sync_ = now;
}

void TimeTransmitter::handle(std::span<const std::uint8_t> bytes,
                             std::optional<ReferenceTime> received, ActionList& actions) noexcept {
  if (state_ != PortState::kTimeTransmitter) {
    counters_.add(Counter::kNotListening);
    return;
  }
  const auto message = decode(bytes);
  if (!message) {
    counters_.add(counter_of(message.error().reason));
    return;
  }
  if (!is_for_us(message->header)) return;
  switch (type_of(message->body)) {
    case MessageType::kDelayReq:
      if (!received) return counters_.add(Counter::kWrongChannel);
      return answer(message->header, *received, actions);
    case MessageType::kPdelayReq:
    case MessageType::kPdelayResp:
    case MessageType::kPdelayRespFollowUp:
      return counters_.add(Counter::kPdelayIgnored);
    case MessageType::kSignaling:
      return counters_.add(Counter::kSignalingIgnored);
    case MessageType::kManagement:
      return counters_.add(Counter::kManagementIgnored);
    case MessageType::kSync:
    case MessageType::kFollowUp:
    case MessageType::kDelayResp:
    case MessageType::kAnnounce:
      return counters_.add(Counter::kNotForThisRole);
  }
}

bool TimeTransmitter::is_for_us(const Header& header) noexcept {
  if (header.major_sdo_id != config_.major_sdo_id) {
    counters_.add(Counter::kWrongSdo);
  } else if (header.domain != config_.domain) {
    counters_.add(Counter::kWrongDomain);
  } else if (header.source == config_.port) {
    counters_.add(Counter::kOwnMessage);
  } else {
    return true;
  }
  return false;
}

/// 11.3.2: t4 without its fraction, which is taken from the correction instead (reference = t4 -
/// correction).
void TimeTransmitter::answer(const Header& request, ReferenceTime received,
                             ActionList& actions) noexcept {
  counters_.add(Counter::kDelayReqReceived);
  const bool unicast = request.has(flag::kUnicast);
  Message message{header(request.sequence_id, config_.log_min_delay_req_interval),
                  DelayResp{received, request.source}};
  message.header.flags = unicast ? flag::kUnicast : std::uint16_t{0};
  if (unicast) message.header.log_interval = kNoLogInterval;
  message.header.correction = request.correction - fraction_of(received);
  if (send(message, unicast ? Destination::kSender : Destination::kMulticast, actions)) {
    counters_.add(Counter::kDelayRespSent);
  }
}

void TimeTransmitter::send_announce(ActionList& actions) noexcept {
  Message message{header(next_announce_id_++, config_.log_announce_interval),
                  Announce{.origin = {},
                           .utc_offset = config_.utc_offset,
                           .priority1 = config_.priority1,
                           .quality = config_.quality,
                           .priority2 = config_.priority2,
                           .grandmaster = config_.port.clock,
                           .steps_removed = 0,
                           .time_source = config_.time_source}};
  message.header.flags |= config_.announce_flags;
  if (send(message, config_.unicast ? Destination::kPeer : Destination::kMulticast, actions)) {
    counters_.add(Counter::kAnnounceSent);
  }
}

void TimeTransmitter::send_sync(ActionList& actions) noexcept {
  const std::uint16_t sequence_id = next_sync_id_++;
  Message message{header(sequence_id, config_.log_sync_interval), Sync{}};
  message.header.flags |= flag::kTwoStep;
  // Ids are consecutive: this place belongs to the Sync four before.
  OpenSync& sync = open_syncs_[sequence_id % kOpenSyncs];
  if (sync.open) counters_.add(Counter::kMissingTransmitStamp);
  sync = OpenSync{true, sequence_id};
  if (send(message, config_.unicast ? Destination::kPeer : Destination::kMulticast, actions)) {
    counters_.add(Counter::kSyncSent);
  }
}

TimeTransmitter::OpenSync* TimeTransmitter::find(std::uint16_t sequence_id) noexcept {
  OpenSync& sync = open_syncs_[sequence_id % kOpenSyncs];
  return sync.open && sync.sequence_id == sequence_id ? &sync : nullptr;
}

Header TimeTransmitter::header(std::uint16_t sequence_id, std::int8_t log_interval) const noexcept {
  Header header;
  header.major_sdo_id = config_.major_sdo_id;
  header.minor_version = config_.minor_version;
  header.domain = config_.domain;
  header.flags = config_.unicast ? flag::kUnicast : std::uint16_t{0};
  header.source = config_.port;
  header.sequence_id = sequence_id;
  header.log_interval = config_.unicast ? kNoLogInterval : log_interval;
  return header;
}

bool TimeTransmitter::send(const Message& message, Destination destination,
                           ActionList& actions) noexcept {
  const auto bytes = encode(message);
  if (!bytes) {
    counters_.add(Counter::kUnusableTime);
    return false;
  }
  const MessageType type = type_of(message.body);
  push(SendMessage{is_event(type) ? Channel::kEvent : Channel::kGeneral, destination, type,
                   message.header.sequence_id, *bytes},
       actions);
  return true;
}

void TimeTransmitter::change_state(PortState to, PortEvent event, ActionList& actions) noexcept {
  const PortState from = state_;
  state_ = to;
  push(PortStateChanged{from, to, event}, actions);
}

void TimeTransmitter::push(const Action& action, ActionList& actions) noexcept {
  if (!actions.push(action)) counters_.add(Counter::kActionsDropped);
}

}  // namespace ftcs::ptp
