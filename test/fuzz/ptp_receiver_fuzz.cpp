// SPDX-License-Identifier: MIT
//
// The octets are a script: each step hands one input to a time receiver; most messages are
// well-formed, with fields from a small set of plausible and extreme values, so that the state
// machine behind the decoder is reached. The script ends where the octets end.
//
//   step    = advance (1 octet, units of 8 ms), input (1 octet), operands
//   message = source, sequence, flags, correction, interval, time (1 octet each)
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "ftcs/ptp/time_receiver.h"
#include "ftcs/ptp/wire/byte_order.h"
#include "test/fuzz/require.h"

namespace ftcs::ptp {
namespace {
using fuzz::require;
using namespace std::chrono_literals;

const PortIdentity kUs{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};

/// Longest pause between two deadlines that the timer test follows at one instant.
constexpr int kTimersAtOnce = 64;

class Script {
 public:
  explicit Script(std::span<const std::uint8_t> octets) : octets_(octets), reader_(octets) {
    TimeReceiverConfig config;
    config.port = kUs;
    config.seed = 1;
    receiver_ = TimeReceiver(config);
    check(receiver_.start(now_));
  }

  void run() {
    while (reader_.offset() < octets_.size()) {
      now_ = now_ + Duration{8ms * int{octet()}};
      step();
      fire_timers();
    }
  }

 private:
  std::uint8_t octet() { return reader_.read<std::uint8_t>(); }

  void step() {
    switch (octet() % 16) {
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
            receiver_.on_transmit_timestamp_missing({MessageType::kDelayReq, octet()}, now_));
      case 5:
      case 6:
        return check(receiver_.on_transmit_timestamp({MessageType::kDelayReq, last_request_},
                                                     stamp(), now_));
      case 7:
        return raw_message();
      case 8:
      case 9:
        return general(announce());
      case 10:
      case 11: {
        const auto bytes = encode(message(Sync{time()}));
        if (bytes) check(receiver_.on_event_message(bytes->view(), stamp(), now_));
        return;
      }
      case 12:
      case 13:
        return general(message(FollowUp{time()}));
      case 14:
        return general(message(DelayResp{time(), octet() < 250 ? kUs : port()}, true));
      default:
        return general(message(Management{}));
    }
  }

  void raw_message() {
    const std::size_t size = octet();
    std::array<std::uint8_t, 255> bytes{};
    for (std::size_t i = 0; i < size; ++i) bytes[i] = octet();
    check(receiver_.on_event_message({bytes.data(), size}, stamp(), now_));
    check(receiver_.on_general_message({bytes.data(), size}, now_));
  }
  void general(const Message& message) {
    const auto bytes = encode(message);
    if (bytes) check(receiver_.on_general_message(bytes->view(), now_));
  }
  PortIdentity port() {
    return {ClockIdentity::from_mac({2, 0, 0, 0, 0, static_cast<std::uint8_t>(octet() % 12)}), 1};
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
  Duration correction() {
    const std::uint8_t choice = octet();
    if (choice < 64) return Duration::from_whole_ns(choice);
    if (choice < 128) return Duration::from_whole_ns(-std::int64_t{choice});
    return Duration::from_scaled_ns(std::int64_t{choice} << 55);
  }
  /// Near the right time, a jump away, or at an end of what a Timestamp can hold.
  ReferenceTime time() {
    const std::uint8_t choice = octet();
    if (choice == 255) return ReferenceTime::from_ns(std::numeric_limits<std::int64_t>::max());
    if (choice == 254) return {};
    const Duration jump{1s * (choice > 200 ? int{choice} - 227 : 0)};
    return ReferenceTime{now_.since_epoch() + jump + Duration{100us * int{choice}}};
  }
  FreeRunningTime stamp() {
    const std::uint8_t choice = octet();
    if (choice == 255) return FreeRunningTime::from_ns(std::numeric_limits<std::int64_t>::max());
    if (choice == 254) return FreeRunningTime::from_ns(std::numeric_limits<std::int64_t>::min());
    return now_ - Duration{10us * int{choice}};
  }

  void fire_timers() {
    for (int i = 0; i < kTimersAtOnce; ++i) {
      const auto due = receiver_.deadline();
      if (!due || *due > now_) return;
      check(receiver_.on_timer(now_));
    }
    require(false, "timers at one instant come to an end");
  }

  void check(const ActionList& actions) {
    for (const Action& action : actions) {
      if (const auto* emit = std::get_if<EmitPair>(&action)) check_pair(emit->pair);
      if (const auto* change = std::get_if<PortStateChanged>(&action)) {
        require(change->from != change->to, "a change changes something");
        require(change->from == state_, "each change starts where the last one ended");
        state_ = change->to;
      }
      if (const auto* send = std::get_if<SendMessage>(&action)) {
        const auto sent = decode(send->bytes.view());
        require(sent.ok() && sent->header.source == kUs,
                "what it sends is well-formed and its own");
        require(type_of(sent->body) == MessageType::kDelayReq,
                "a receiver only asks for the delay");
        last_request_ = send->sequence_id;
      }
    }
    const bool following = receiver_.state() == PortState::kUncalibrated ||
                           receiver_.state() == PortState::kTimeReceiver;
    require(receiver_.state() == state_, "each change of state is told");
    require(following == (receiver_.transmitter() != nullptr), "it follows whom it has selected");
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
    for (std::size_t i = 0; i < kCounters; ++i) {
      const auto counter = static_cast<Counter>(i);
      require(counters[counter] >= before_[counter], "counters only grow");
    }
    require(counters[Counter::kActionsDropped] == 0, "the list holds all actions");
    require(counters[Counter::kForwardPairs] == forward_, "forward pairs are counted");
    require(counters[Counter::kBackwardPairs] == backward_, "backward pairs are counted");
    before_ = counters;
  }

  std::span<const std::uint8_t> octets_;
  ByteReader reader_;
  TimeReceiver receiver_{TimeReceiverConfig{}};
  FreeRunningTime now_ = FreeRunningTime{Duration{1h}};
  PortState state_ = PortState::kInitializing;
  std::uint16_t sequence_ = 0;
  std::uint16_t last_request_ = 0;
  std::uint64_t forward_ = 0;
  std::uint64_t backward_ = 0;
  Counters before_;
};

}  // namespace
}  // namespace ftcs::ptp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ftcs::ptp::Script({data, size}).run();
  return 0;
}
