// SPDX-License-Identifier: MIT
#include "ftcs/ptp/port.h"

namespace ftcs::ptp {

std::optional<Message> Port::read(std::span<const std::uint8_t> bytes) noexcept {
  if (!is_active()) {
    count(Counter::kNotListening);
    return std::nullopt;
  }
  const auto decoded = decode(bytes);
  if (!decoded) {
    count(counter_of(decoded.error().reason));
    return std::nullopt;
  }
  if (!is_for_us(decoded->header) || !is_authentic(bytes)) return std::nullopt;
  std::optional<Message> message{*decoded};
  const MessageType type = type_of(message->body);
  if (config_.assume_two_step && (type == MessageType::kSync || type == MessageType::kPdelayResp)) {
    message->header.flags |= flag::kTwoStep;
  }
  return message;
}

bool Port::is_for_us(const Header& header) noexcept {
  if (header.major_sdo_id != config_.major_sdo_id) {
    count(Counter::kWrongSdo);
  } else if (header.domain != config_.domain) {
    count(Counter::kWrongDomain);
  } else if (header.source == config_.identity) {
    count(Counter::kOwnMessage);
  } else {
    return true;
  }
  return false;
}

bool Port::is_authentic(std::span<const std::uint8_t> bytes) noexcept {
  if (config_.security == nullptr) return true;
  const Authenticity found = authenticate(*config_.security, bytes);
  switch (found) {
    case Authenticity::kAuthentic:
      count(Counter::kAuthenticated);
      break;
    case Authenticity::kMissing:
      count(Counter::kAuthenticationMissing);
      break;
    case Authenticity::kUnsupported:
      count(Counter::kAuthenticationUnsupported);
      break;
    case Authenticity::kUnknownKey:
      count(Counter::kAuthenticationUnknownKey);
      break;
    case Authenticity::kWrongCode:
      count(Counter::kAuthenticationWrongCode);
      break;
  }
  return found == Authenticity::kAuthentic;
}

Header Port::header(std::uint16_t sequence_id, std::int8_t log_interval) const noexcept {
  Header header;
  header.major_sdo_id = config_.major_sdo_id;
  header.minor_version = config_.minor_version;
  header.domain = config_.domain;
  header.flags = config_.unicast ? flag::kUnicast : std::uint16_t{0};
  header.source = config_.identity;
  header.sequence_id = sequence_id;
  header.log_interval = config_.unicast ? kNoLogInterval : log_interval;
  return header;
}

void Port::send(const Message& message, Destination destination, Counter sent,
                ActionList& actions) noexcept {
  auto bytes = encode(message);
  if (!bytes) return count(Counter::kUnusableTime);
  if (config_.security != nullptr && !seal(*config_.security, *bytes)) {
    return count(Counter::kNotSealed);
  }
  count(sent);
  if (config_.unicast && destination != Destination::kSender) destination = Destination::kPeer;
  const MessageType type = type_of(message.body);
  push(SendMessage{is_event(type) ? Channel::kEvent : Channel::kGeneral, destination, type,
                   message.header.sequence_id, *bytes},
       actions);
}

void Port::change_state(PortState to, PortEvent event, ActionList& actions) noexcept {
  const PortState from = state_;
  state_ = to;
  push(PortStateChanged{from, to, event}, actions);
}

void Port::push(const Action& action, ActionList& actions) noexcept {
  if (!actions.push(action)) count(Counter::kActionsDropped);
}

}  // namespace ftcs::ptp
