// SPDX-License-Identifier: MIT
//
// The octets are a script: each step hands one input to a time receiver; most messages are
// well-formed, with fields from a small set of plausible and extreme values, so that the state
// machine behind the decoder is reached. The script ends where the octets end.
//
//   step    = advance (1 octet, units of 8 ms), input (1 octet), operands
//   message = source, sequence, flags, correction, interval, time (1 octet each)
//
// The last octet chooses the receiver's profile.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "ftcs/ptp/time_receiver.h"
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
    receiver_ = TimeReceiver(config_);
    check(receiver_.start(now_));
  }

  void run() {
    while (!ended()) {
      now_ = now_ + Duration{8ms * int{octet()}};
      step();
      fire_timers(receiver_, [this](const ActionList& actions) { check(actions); });
    }
  }

 private:
  static TimeReceiverConfig profile(std::uint8_t bits) {
    TimeReceiverConfig config;
    config.port = kUs;
    config.seed = 1;
    if ((bits & 1) != 0) config.delay_mechanism = DelayMechanism::kPeerToPeer;
    config.peer_delay.capability_needed = (bits & 3) == 3;
    config.fast_start = (bits & 4) != 0;
    config.hybrid = (bits & 8) != 0;
    config.assume_two_step = (bits & 16) != 0;
    config.sync_receipt_timeout = (bits & 32) != 0 ? 3 : 0;
    if ((bits & 64) != 0) {
      require(config.acceptable.add(ClockIdentity::from_mac({2, 0, 0, 0, 0, 2})), "there is room");
    }
    config.major_sdo_id = (bits & 128) != 0 ? 1 : 0;
    return config;
  }

  void step() {
    switch (octet() % 24) {
      case 0:
        return check(receiver_.on_link_down(now_));
      case 1:
        return check(receiver_.on_link_up(now_));
      case 2:
        return check(receiver_.on_servo_locked(now_));
      case 3:
        return check(receiver_.on_servo_unlocked(now_));
      case 4:
        return check(
            receiver_.on_transmit_timestamp_missing({MessageType::kDelayReq, octet(), {}}, now_));
      case 5:
      case 6:
        return check(receiver_.on_transmit_timestamp(last_event_, stamp(), now_));
      case 7:
        return raw_message();
      case 8:
      case 9:
        return general(announce());
      case 10:
      case 11:
        return event(message(Sync{time()}));
      case 12:
      case 13:
        return general(message(follow_up()));
      case 14:
        return general(message(DelayResp{time(), octet() < 250 ? kUs : port()}, true));
      case 15:
        return general(message(Management{}));
      case 16:
        return event(message(PdelayReq{time()}));
      case 17:
      case 18:
        return event(message(PdelayResp{time(), octet() < 250 ? kUs : port()}, true));
      case 19:
      case 20:
        return general(message(PdelayRespFollowUp{time(), octet() < 250 ? kUs : port()}, true));
      case 21:
        return check(receiver_.on_transmit_timestamp_missing(last_event_, now_));
      case 22:
        return event(message(Sync{time()}));
      default:
        return check(receiver_.on_timer(now_));
    }
  }

  void raw_message() {
    const Raw message = raw();
    check(receiver_.on_event_message(message.view(), stamp(), now_));
    check(receiver_.on_general_message(message.view(), now_));
  }
  void event(const Message& message) {
    auto bytes = encode(message);
    if (!bytes) return;
    authenticate(*bytes);
    check(receiver_.on_event_message(bytes->view(), stamp(), now_));
  }
  FollowUp follow_up() {
    FollowUp body{time()};
    const std::uint8_t choice = octet();
    body.has_information = choice > 127;
    body.information.cumulative_scaled_rate_offset = std::int32_t{choice} << 23;
    body.information.gm_time_base_indicator = choice % 3;
    body.information.last_gm_phase_change = Duration::from_scaled_ns(std::int64_t{choice} << 55);
    return body;
  }
  void general(const Message& message) {
    auto bytes = encode(message);
    if (!bytes) return;
    authenticate(*bytes);
    check(receiver_.on_general_message(bytes->view(), now_));
  }
  Message message(const Body& body, bool answer = false) {
    Message message;
    message.body = body;
    message.header.source = port();
    const std::uint8_t sequence = octet();
    message.header.sequence_id = answer ? static_cast<std::uint16_t>(last_request_ + sequence / 64)
                                        : static_cast<std::uint16_t>(sequence_ += sequence / 32);
    const std::uint8_t flags = octet();
    if ((flags & 1) != 0) message.header.flags |= flag::kTwoStep;
    if (flags > 250) message.header.flags |= flag::kAlternateTransmitter;
    // Late: behind messages that were sent after it.
    if (flags >= 240 && flags < 250) message.header.sequence_id -= flags - 239;
    message.header.major_sdo_id = config_.major_sdo_id;
    message.header.correction = correction();
    message.header.log_interval = static_cast<std::int8_t>(octet());
    return message;
  }
  Message announce() {
    Announce announce;
    announce.grandmaster = port().clock;
    announce.priority1 = octet();
    announce.steps_removed = octet();
    return message(announce);
  }
  FreeRunningTime stamp() {
    const std::uint8_t choice = octet();
    if (choice == 255) return FreeRunningTime::from_ns(std::numeric_limits<std::int64_t>::max());
    if (choice == 254) return FreeRunningTime::from_ns(std::numeric_limits<std::int64_t>::min());
    return now_ - Duration{10us * int{choice}};
  }

  void check(const ActionList& actions) {
    for (const Action& action : actions) {
      if (const auto* emit = std::get_if<EmitPair>(&action)) check_pair(emit->pair);
      if (const auto* delay = std::get_if<EmitPeerDelay>(&action)) {
        ++peer_delays_;
        require(abs(delay->mean_link_delay) <= Duration{2 * kMaximumPeerDelay},
                "a peer delay is one");
        require(std::abs(delay->neighbor_rate_ratio.deviation()) < 0.1, "a rate is one");
      }
      if (const auto* change = std::get_if<PortStateChanged>(&action)) {
        require(change->from != change->to, "a change changes something");
        require(change->from == state_, "each change starts where the last one ended");
        state_ = change->to;
      }
      if (const auto* send = std::get_if<SendMessage>(&action)) {
        const auto sent = decode(send->bytes.view());
        require(sent.ok() && sent->header.source == kUs,
                "what it sends is well-formed and its own");
        require(config_.security == nullptr ||
                    ftcs::ptp::authenticate(*config_.security, send->bytes.view()) ==
                        Authenticity::kAuthentic,
                "and authentic where there are keys");
        const MessageType type = type_of(sent->body);
        const bool request = type == MessageType::kDelayReq || type == MessageType::kPdelayReq;
        require(
            request || type == MessageType::kPdelayResp || type == MessageType::kPdelayRespFollowUp,
            "a receiver only asks for the delay, and answers its neighbour");
        if (request) last_request_ = send->sequence_id;
        if (is_event(type)) last_event_ = send->id();
      }
    }
    const bool following = receiver_.state() == PortState::kUncalibrated ||
                           receiver_.state() == PortState::kTimeReceiver;
    require(receiver_.state() == state_, "each change of state is told");
    require(following == (receiver_.transmitter() != nullptr), "it follows whom it has selected");
    const Rate rate = receiver_.grandmaster_rate_ratio().value_or(Rate{});
    require(std::abs(rate.deviation()) < 0.2, "the grandmaster's rate is one");
    const Duration delay = receiver_.peer_delay().mean_link_delay().value_or(Duration{});
    require(abs(delay) <= Duration{2 * kMaximumPeerDelay}, "the link's delay is one");
    check_counters();
  }
  void check_pair(const EventPair& pair) {
    (pair.direction == Direction::kForward ? forward_ : backward_) += 1;
    // Two corrections of at most a second each may lead out of what a Timestamp holds, not further.
    const std::int64_t ns = pair.reference.since_epoch().floor_ns();
    constexpr auto kMargin = 2 * Nanoseconds{kMaximumCorrection}.count();
    require(ns >= -kMargin || ns < std::numeric_limits<std::int64_t>::min() + kMargin,
            "a pair's reference lies near what the wire can carry");
  }
  void check_counters() {
    const Counters& counters = receiver_.counters();
    require_growth(counters);
    require(config_.security != nullptr || counters[Counter::kReplayed] == 0, "keys alone refuse");
    require(counters[Counter::kNotSealed] == 0, "each message has a code");
    require(counters[Counter::kForwardPairs] == forward_, "forward pairs are counted");
    require(counters[Counter::kBackwardPairs] == backward_, "backward pairs are counted");
    require(counters[Counter::kPeerDelays] == peer_delays_, "peer delays are counted");
  }

  TimeReceiverConfig config_;
  TimeReceiver receiver_{TimeReceiverConfig{}};
  PortState state_ = PortState::kInitializing;
  std::uint16_t sequence_ = 0;
  std::uint16_t last_request_ = 0;
  EventId last_event_{};
  std::uint64_t forward_ = 0;
  std::uint64_t backward_ = 0;
  std::uint64_t peer_delays_ = 0;
};

}  // namespace
}  // namespace ftcs::ptp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ftcs::ptp::Script({data, size}).run();
  return 0;
}
