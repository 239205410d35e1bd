// SPDX-License-Identifier: MIT
#include "ftcs/ptp/time_transmitter.h"

#include <algorithm>
#include <chrono>
#include <variant>

#include "ftcs/ptp/interval.h"
#include "ftcs/ptp/wire/fields.h"
#include "ftcs/time/relabel.h"

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

PortConfig port_config(const TimeTransmitterConfig& config) noexcept {
  return {config.port,    config.domain,          config.major_sdo_id, config.minor_version,
          config.unicast, config.assume_two_step, config.security};
}

/// Our event clock is the reference; the peer delay mechanism only asks that it is one clock.
FreeRunningTime event_clock(ReferenceTime stamp) noexcept {
  return relabel<FreeRunningTime>(stamp);
}

}  // namespace

TimeTransmitter::TimeTransmitter(const Config& config) noexcept
    : config_(config),
      announce_interval_(interval_or_second(config.log_announce_interval)),
      sync_interval_(interval_or_second(config.log_sync_interval)),
      port_(port_config(config)),
      peer_delay_(config.peer_delay) {}

ActionList TimeTransmitter::start(FreeRunningTime now) noexcept {
  ActionList actions;
  if (port_.state() == PortState::kInitializing) begin_transmitting(now, actions);
  return actions;
}

ActionList TimeTransmitter::on_event_message(std::span<const std::uint8_t> bytes,
                                             ReferenceTime received, FreeRunningTime) noexcept {
  ActionList actions;
  if (const auto message = port_.read(bytes)) dispatch(*message, received, actions);
  return actions;
}

ActionList TimeTransmitter::on_general_message(std::span<const std::uint8_t> bytes,
                                               FreeRunningTime) noexcept {
  ActionList actions;
  if (const auto message = port_.read(bytes)) dispatch(*message, std::nullopt, actions);
  return actions;
}

ActionList TimeTransmitter::on_transmit_timestamp(const EventId& id, ReferenceTime sent,
                                                  FreeRunningTime) noexcept {
  ActionList actions;
  if (id.type != MessageType::kSync) {
    peer_delay_.on_sent(id, event_clock(sent), port_, actions);
    return actions;
  }
  OpenSync* const sync = find(id.sequence_id);
  if (sync == nullptr) {
    port_.count(Counter::kUnexpectedTransmitStamp);
    return actions;
  }
  *sync = OpenSync{};
  FollowUp follow_up{sent};
  follow_up.has_information = config_.follow_up_info;  // all zero: we are the grandmaster
  Message message{port_.header(id.sequence_id, config_.log_sync_interval), follow_up};
  message.header.correction = fraction_of(sent);  // 9.5.10: what preciseOriginTimestamp cannot hold
  port_.send(message, Destination::kMulticast, Counter::kFollowUpSent, actions);
  return actions;
}

ActionList TimeTransmitter::on_transmit_timestamp_missing(const EventId& id,
                                                          FreeRunningTime) noexcept {
  if (id.type != MessageType::kSync) {
    peer_delay_.on_stamp_missing(id, port_);
    return {};
  }
  OpenSync* const sync = find(id.sequence_id);
  const bool awaited = sync != nullptr && !sync->overdue;
  port_.count(awaited ? Counter::kMissingTransmitStamp : Counter::kUnexpectedTransmitStamp);
  if (awaited) sync->overdue = true;
  return {};
}

ActionList TimeTransmitter::on_timer(FreeRunningTime now) noexcept {
  ActionList actions;
  if (port_.state() != PortState::kTimeTransmitter) return actions;
  peer_delay_.on_timer(now, port_, actions);
  // 802.1AS-2020, 10.2.5.1: to a neighbour that is not capable nothing is sent; the schedule goes
  // on.
  const bool capable = peer_delay_.capable();
  if (now >= next_announce_) {
    if (capable) send_announce(actions);
    next_announce_ = after(next_announce_, announce_interval_, now);
  }
  if (now >= next_sync_) {
    if (capable) send_sync(actions);
    next_sync_ = after(next_sync_, sync_interval_, now);
  }
  return actions;
}

ActionList TimeTransmitter::on_link_down(FreeRunningTime) noexcept {
  ActionList actions;
  if (port_.state() != PortState::kTimeTransmitter) return actions;
  port_.count(Counter::kLinkDown);
  open_syncs_ = {};
  peer_delay_.stop();
  port_.change_state(PortState::kFaulty, PortEvent::kFaultDetected, actions);
  return actions;
}

ActionList TimeTransmitter::on_link_up(FreeRunningTime now) noexcept {
  ActionList actions;
  if (port_.state() == PortState::kFaulty) begin_transmitting(now, actions);
  return actions;
}

std::optional<FreeRunningTime> TimeTransmitter::deadline() const noexcept {
  if (port_.state() != PortState::kTimeTransmitter) return std::nullopt;
  FreeRunningTime next = std::min(next_announce_, next_sync_);
  if (const auto request = peer_delay_.deadline()) next = std::min(next, *request);
  return next;
}

void TimeTransmitter::begin_transmitting(FreeRunningTime now, ActionList& actions) noexcept {
  port_.change_state(PortState::kListening, PortEvent::kInitComplete, actions);
  port_.change_state(PortState::kTimeTransmitter, PortEvent::kRecommendedTransmitter, actions);
  next_announce_ = now;
  next_sync_ = now;
  if (peer_to_peer()) peer_delay_.start(now);
}

void TimeTransmitter::dispatch(const Message& message, std::optional<ReferenceTime> received,
                               ActionList& actions) noexcept {
  const Header& header = message.header;
  switch (type_of(message.body)) {
    case MessageType::kDelayReq:
      if (peer_to_peer()) return port_.count(Counter::kDelayIgnored);
      if (!received) return port_.count(Counter::kWrongChannel);
      return answer(header, *received, actions);
    case MessageType::kPdelayReq:
    case MessageType::kPdelayResp:
    case MessageType::kPdelayRespFollowUp:
      return peer_delay_.on_message(
          message, received ? std::optional{event_clock(*received)} : std::nullopt, port_, actions);
    case MessageType::kSignaling:
      return port_.count(Counter::kSignalingIgnored);
    case MessageType::kManagement:
      return port_.count(Counter::kManagementIgnored);
    case MessageType::kAnnounce:
      port_.push(TransmitterSeen{header.source}, actions);
      return port_.count(Counter::kNotForThisRole);
    case MessageType::kSync:
    case MessageType::kFollowUp:
    case MessageType::kDelayResp:
      return port_.count(Counter::kNotForThisRole);
  }
}

/// 11.3.2: t4 without its fraction, which is taken from the correction instead (reference = t4 -
/// correction).
void TimeTransmitter::answer(const Header& request, ReferenceTime received,
                             ActionList& actions) noexcept {
  if (!answer_limit_.admits(request.source, event_clock(received))) {
    return port_.count(Counter::kAnswersRefused);
  }
  port_.count(Counter::kDelayReqReceived);
  const bool unicast = request.has(flag::kUnicast);
  Message message{port_.header(request.sequence_id, config_.log_min_delay_req_interval),
                  DelayResp{received, request.source}};
  message.header.flags = unicast ? flag::kUnicast : std::uint16_t{0};
  if (unicast) message.header.log_interval = kNoLogInterval;
  message.header.correction = request.correction - fraction_of(received);
  port_.send(message, unicast ? Destination::kSender : Destination::kMulticast,
             Counter::kDelayRespSent, actions);
}

void TimeTransmitter::send_announce(ActionList& actions) noexcept {
  Message message{port_.header(next_announce_id_++, config_.log_announce_interval),
                  Announce{.origin = {},
                           .utc_offset = config_.utc_offset,
                           .priority1 = config_.priority1,
                           .quality = config_.quality,
                           .priority2 = config_.priority2,
                           .grandmaster = config_.port.clock,
                           .steps_removed = 0,
                           .time_source = config_.time_source,
                           .path_trace = config_.path_trace}};
  message.header.flags |= config_.announce_flags;
  port_.send(message, Destination::kMulticast, Counter::kAnnounceSent, actions);
}

void TimeTransmitter::send_sync(ActionList& actions) noexcept {
  const std::uint16_t sequence_id = next_sync_id_++;
  Message message{port_.header(sequence_id, config_.log_sync_interval), Sync{}};
  message.header.flags |= flag::kTwoStep;
  // Ids are consecutive: this place belongs to the Sync four before.
  OpenSync& sync = open_syncs_[sequence_id % kOpenSyncs];
  if (sync.open && !sync.overdue) port_.count(Counter::kMissingTransmitStamp);
  sync = OpenSync{true, sequence_id};
  port_.send(message, Destination::kMulticast, Counter::kSyncSent, actions);
}

TimeTransmitter::OpenSync* TimeTransmitter::find(std::uint16_t sequence_id) noexcept {
  OpenSync& sync = open_syncs_[sequence_id % kOpenSyncs];
  return sync.open && sync.sequence_id == sequence_id ? &sync : nullptr;
}

}  // namespace ftcs::ptp
