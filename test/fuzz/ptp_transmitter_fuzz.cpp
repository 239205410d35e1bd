// SPDX-License-Identifier: MIT
//
// The octets are a script, as for the time receiver: each step hands one input to a time
// transmitter, mostly requests with fields from a small set of plausible and extreme values. What
// it sends can be decoded, is its own, and answers who asked.
//
//   step    = advance (1 octet, units of 8 ms), input (1 octet), operands
//   message = source, sequence, flags, correction (1 octet each)
//
// The last octet chooses the profile.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "ftcs/ptp/time_transmitter.h"
#include "test/fuzz/ptp_script.h"

namespace ftcs::ptp {
namespace {
using fuzz::require;
using namespace std::chrono_literals;

class Script : PtpScript {
 public:
  explicit Script(std::span<const std::uint8_t> octets)
      : PtpScript(octets), config_(profile(octets.empty() ? std::uint8_t{0} : octets.back())) {
    config_.security = keys();
    transmitter_ = TimeTransmitter(config_);
    check(transmitter_.start(now_));
  }

  void run() {
    while (!ended()) {
      now_ = now_ + Duration{8ms * int{octet()}};
      asked_.reset();
      step();
      fire_timers(transmitter_, [this](const ActionList& actions) { check(actions); });
    }
  }

 private:
  static TimeTransmitterConfig profile(std::uint8_t bits) {
    TimeTransmitterConfig config;
    config.port = kUs;
    config.log_announce_interval = 0;
    config.log_sync_interval = -3;
    if ((bits & 1) != 0) config.delay_mechanism = DelayMechanism::kPeerToPeer;
    config.peer_delay.capability_needed = (bits & 3) == 3;
    config.unicast = (bits & 4) != 0;
    config.assume_two_step = (bits & 8) != 0;
    config.follow_up_info = config.path_trace = (bits & 16) != 0;
    config.major_sdo_id = (bits & 32) != 0 ? 1 : 0;
    return config;
  }

  void step() {
    switch (octet() % 16) {
      case 0:
        return check(transmitter_.on_link_down(now_));
      case 1:
        return check(transmitter_.on_link_up(now_));
      case 2:
        return check(transmitter_.on_transmit_timestamp_missing(last_event_, now_));
      case 3:
      case 4:
        return check(transmitter_.on_transmit_timestamp(last_event_, stamp(), now_));
      case 5:
        return check(transmitter_.on_transmit_timestamp(
            {octet() < 128 ? MessageType::kSync : MessageType::kPdelayResp, octet(), port()},
            stamp(), now_));
      case 6:
        return raw_message();
      case 7:
      case 8:
      case 9:
        return event(message(DelayReq{time()}));
      case 10:
      case 11:
        return event(message(PdelayReq{time()}));
      case 12:
        return event(answer(PdelayResp{time(), octet() < 250 ? kUs : port()}));
      case 13:
        return general(answer(PdelayRespFollowUp{time(), octet() < 250 ? kUs : port()}));
      case 14:
        return other();
      default:
        return check(transmitter_.on_timer(now_));
    }
  }

  /// What a transmitter hears and does not want; event messages on the wrong port too.
  void other() {
    switch (octet() % 9) {
      case 0:
        return event(message(Sync{time()}));
      case 1:
        return general(message(FollowUp{time()}));
      case 2:
        return general(message(Announce{}));
      case 3:
        return general(message(DelayResp{time(), port()}));
      case 4:
        return general(message(DelayReq{time()}));
      case 5:
        return general(message(PdelayReq{time()}));
      case 6:
        return general(message(Management{}));
      case 7:
        return general(message(Signaling{}));
      default: {
        Message foreign = message(DelayReq{time()});
        foreign.header.domain = 1;
        return event(foreign);
      }
    }
  }
  void raw_message() {
    const Raw message = raw();
    ask(message.view());
    check(transmitter_.on_event_message(message.view(), stamp(), now_));
    check(transmitter_.on_general_message(message.view(), now_));
  }
  void event(const Message& message) {
    auto bytes = encode(message);
    if (!bytes) return;
    authenticate(*bytes);
    ask(bytes->view());
    check(transmitter_.on_event_message(bytes->view(), stamp(), now_));
  }
  void general(const Message& message) {
    auto bytes = encode(message);
    if (!bytes) return;
    authenticate(*bytes);
    check(transmitter_.on_general_message(bytes->view(), now_));
  }
  void ask(std::span<const std::uint8_t> bytes) {
    const auto request = decode(bytes);
    if (request && request->header.domain == config_.domain) asked_ = request->header;
  }
  Message message(const Body& body) {
    Message message;
    message.body = body;
    message.header.major_sdo_id = config_.major_sdo_id;
    message.header.source = port();
    message.header.sequence_id = octet();
    const std::uint8_t flags = octet();
    if ((flags & 1) != 0) message.header.flags |= flag::kTwoStep;
    if ((flags & 2) != 0) message.header.flags |= flag::kUnicast;
    message.header.correction = correction();
    return message;
  }
  Message answer(const Body& body) {
    Message answer = message(body);
    answer.header.sequence_id =
        static_cast<std::uint16_t>(last_request_ + answer.header.sequence_id / 64);
    return answer;
  }
  /// The clock may show anything, times that no message can carry too.
  ReferenceTime stamp() {
    const std::uint8_t choice = octet();
    if (choice == 255) return ReferenceTime::from_ns(std::numeric_limits<std::int64_t>::max());
    if (choice == 254) return ReferenceTime::from_ns(std::numeric_limits<std::int64_t>::min());
    if (choice == 253) return ReferenceTime::from_ns(-1);
    return ReferenceTime{now_.since_epoch() - Duration{10us * int{choice}} +
                         Duration::from_ns(choice / 256.0)};
  }

  void check(const ActionList& actions) {
    for (const Action& action : actions) {
      if (const auto* change = std::get_if<PortStateChanged>(&action)) {
        require(change->from == state_ && change->to != state_, "states follow each other");
        state_ = change->to;
      } else if (const auto* send = std::get_if<SendMessage>(&action)) {
        check_sent(*send);
      } else if (const auto* delay = std::get_if<EmitPeerDelay>(&action)) {
        require(abs(delay->mean_link_delay) <= Duration{2 * kMaximumPeerDelay},
                "a peer delay is one");
        require(std::abs(delay->neighbor_rate_ratio.deviation()) < 0.1, "a rate is one");
      } else if (const auto* other = std::get_if<TransmitterSeen>(&action)) {
        require(other->port != kUs, "another transmitter is another");
      } else {
        require(false, "a transmitter follows nobody");
      }
    }
    require(transmitter_.state() == state_, "each change of state is told");
    require_growth(transmitter_.counters());
  }
  void check_sent(const SendMessage& send) {
    const auto sent = decode(send.bytes.view());
    require(sent.ok(), "what it sends can be decoded");
    require(config_.security == nullptr ||
                ftcs::ptp::authenticate(*config_.security, send.bytes.view()) ==
                    Authenticity::kAuthentic,
            "and is authentic where there are keys");
    const Header& header = sent->header;
    const MessageType type = type_of(sent->body);
    require(header.source == kUs && header.major_sdo_id == config_.major_sdo_id, "it is its own");
    require(type == send.type && header.sequence_id == send.sequence_id, "it is what it says");
    require((send.channel == Channel::kEvent) == is_event(type), "events go where stamps are made");
    require(state_ == PortState::kTimeTransmitter, "nothing is sent while there is a fault");
    if (is_event(type)) last_event_ = send.id();
    if (type == MessageType::kPdelayReq) last_request_ = send.sequence_id;
    if (const auto* response = std::get_if<DelayResp>(&sent->body)) {
      require(asked_.has_value(), "a Delay_Resp answers a request");
      require(response->requesting_port == asked_->source, "and the one who asked");
      require(header.sequence_id == asked_->sequence_id, "and this request of his");
      require(config_.delay_mechanism == DelayMechanism::kEndToEnd, "not peer to peer");
      if (send.destination == Destination::kSender) {
        require(header.has(flag::kUnicast), "what goes to one alone says so");
      }
    } else if (const auto* peer = std::get_if<PdelayResp>(&sent->body)) {
      require(asked_ && peer->requesting_port == asked_->source, "a Pdelay_Resp likewise");
      require(config_.delay_mechanism == DelayMechanism::kPeerToPeer, "only peer to peer");
    }
    require(type != MessageType::kDelayReq && type != MessageType::kManagement &&
                type != MessageType::kSignaling,
            "and nothing else");
  }

  TimeTransmitterConfig config_;
  TimeTransmitter transmitter_{TimeTransmitterConfig{}};
  PortState state_ = PortState::kInitializing;
  std::optional<Header> asked_{};  ///< of the message of this step
  std::uint16_t last_request_ = 0;
  EventId last_event_{};
};

}  // namespace
}  // namespace ftcs::ptp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ftcs::ptp::Script({data, size}).run();
  return 0;
}
