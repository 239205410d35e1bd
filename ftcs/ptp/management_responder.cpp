// SPDX-License-Identifier: MIT
#include "ftcs/ptp/management_responder.h"

#include <algorithm>

namespace ftcs::ptp {
namespace {

/// 15.4.1.2: all ones addresses every clock, or every port of one.
constexpr std::uint16_t kEveryPort = 0xFFFF;

bool is_every_clock(const ClockIdentity& clock) noexcept {
  return std::all_of(clock.octets.begin(), clock.octets.end(),
                     [](std::uint8_t octet) { return octet == 0xFF; });
}

bool is_for(const ManagementMessage& request, const ManagedPort& port) noexcept {
  return request.header.domain == port.domain && request.header.major_sdo_id == port.major_sdo_id &&
         (is_every_clock(request.body.target.clock) ||
          request.body.target.clock == port.identity.clock);
}

std::optional<ManagementData> data_of(ManagementId id, const ManagedPort& port) noexcept {
  switch (id) {
    case ManagementId::kNullManagement:
      return NullManagement{};
    case ManagementId::kClockDescription:
      return port.description;
    case ManagementId::kUserDescription:
      return port.user;
    case ManagementId::kDefaultDataSet:
      return port.default_set;
    case ManagementId::kCurrentDataSet:
      return port.current;
    case ManagementId::kParentDataSet:
      return port.parent;
    case ManagementId::kTimePropertiesDataSet:
      return port.time_properties;
    case ManagementId::kPortDataSet:
      return port.port;
    case ManagementId::kDomain:
      return Domain{port.domain};
    case ManagementId::kTimeStatusNp:
      return port.time_status;
    case ManagementId::kPortDataSetNp:
      return port.port_np;
    case ManagementId::kPortPropertiesNp:
      return port.properties;
    case ManagementId::kPortStatsNp:
      return port.stats;
    case ManagementId::kSubscribeEventsNp:
      return port.subscription;
  }
  return std::nullopt;
}

/// Data of the port, not of the clock: the answer comes from port 1 and not from 0.
bool is_of_port(ManagementId id) noexcept {
  switch (id) {
    case ManagementId::kUserDescription:
    case ManagementId::kDefaultDataSet:
    case ManagementId::kCurrentDataSet:
    case ManagementId::kParentDataSet:
    case ManagementId::kTimePropertiesDataSet:
    case ManagementId::kDomain:
    case ManagementId::kTimeStatusNp:
    case ManagementId::kSubscribeEventsNp:
      return false;
    default:
      return true;
  }
}

/// What of it we tell: the state of the port.
std::optional<SubscribeEventsNp> subscription_in(const ManagementMessage& request) noexcept {
  if (request.action() != ManagementAction::kSet || !request.data) return std::nullopt;
  const auto* const wanted = std::get_if<SubscribeEventsNp>(&*request.data);
  if (wanted == nullptr) return std::nullopt;
  constexpr std::uint8_t kTold = 1U << SubscribeEventsNp::kPortState;
  SubscribeEventsNp granted;
  granted.duration_s = wanted->duration_s;
  granted.events[0] = wanted->events[0] & kTold;
  return granted;
}

/// The answer's data or error.
void fill(const ManagementMessage& request, const ManagedPort& port,
          ManagementMessage& answer) noexcept {
  const auto data = data_of(request.id, port);
  const std::uint16_t target = request.body.target.port;
  if (!data) {
    answer.error = ManagementError::kNoSuchId;
  } else if (is_of_port(request.id) && target != kEveryPort && target != port.identity.port) {
    answer.error = ManagementError::kWrongValue;
  } else if (const auto subscription = subscription_in(request)) {
    answer.data = *subscription;
  } else if (request.action() == ManagementAction::kSet) {
    answer.error = ManagementError::kNotSetable;
  } else if (request.action() == ManagementAction::kCommand) {
    answer.error = ManagementError::kNotSupported;
  } else {
    answer.data = data;
  }
}

}  // namespace

std::optional<ManagementBytes> ManagementResponder::answer(std::span<const std::uint8_t> request,
                                                           const ManagedPort& port) noexcept {
  const auto message = decode_management(request);
  if (!message) {
    ++counters_.malformed;
    return std::nullopt;
  }
  const ManagementAction action = message->action();
  const bool asks = action == ManagementAction::kGet || action == ManagementAction::kSet ||
                    action == ManagementAction::kCommand;
  if (!asks || message->error || !is_for(*message, port)) {
    ++counters_.ignored;
    return std::nullopt;
  }
  ManagementMessage answer;
  answer.header.major_sdo_id = message->header.major_sdo_id;
  answer.header.minor_version = message->header.minor_version;
  answer.header.domain = message->header.domain;
  answer.header.source = port.identity;
  if (!is_of_port(message->id)) answer.header.source.port = 0;
  answer.header.sequence_id = message->header.sequence_id;
  answer.body.target = message->header.source;
  // 15.4.1.4: as many hops back as the request had come.
  answer.body.starting_boundary_hops =
      static_cast<std::uint8_t>(message->body.starting_boundary_hops - message->body.boundary_hops);
  answer.body.boundary_hops = answer.body.starting_boundary_hops;
  answer.body.action = static_cast<std::uint8_t>(action == ManagementAction::kCommand
                                                     ? ManagementAction::kAcknowledge
                                                     : ManagementAction::kResponse);
  answer.id = message->id;
  fill(*message, port, answer);
  if (const auto wanted = subscription_in(*message)) {
    subscription_ = Subscription{message->header.source, *wanted};
  }
  ++(answer.error ? counters_.refused : counters_.answered);
  return encode_management(answer);
}

ManagementBytes ManagementResponder::port_state_notice(const ManagedPort& port,
                                                       const PortIdentity& subscriber,
                                                       std::uint16_t sequence_id) noexcept {
  ManagementMessage notice;
  notice.header.major_sdo_id = port.major_sdo_id;
  notice.header.domain = port.domain;
  notice.header.source = port.identity;
  notice.header.sequence_id = sequence_id;
  notice.body.target = subscriber;
  notice.body.action = static_cast<std::uint8_t>(ManagementAction::kResponse);
  notice.data = port.port;
  return encode_management(notice);
}

}  // namespace ftcs::ptp
