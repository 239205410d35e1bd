// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/time_receiver.h"
#include "test/support/actions.h"

/// The world of the receiver's tests: a receiver on its free-running clock, which shows true time
/// plus 5 s, and messages that a test hands to it by its own hand: well-formed unless the test
/// breaks them. Transmitter A announces once a second and sends two-step Syncs eight times a
/// second.
namespace ftcs::ptp::receiver_test {
using namespace std::chrono_literals;

inline const PortIdentity kA{ClockIdentity::from_mac({2, 0, 0, 0, 0, 0xA}), 1};
inline const PortIdentity kB{ClockIdentity::from_mac({2, 0, 0, 0, 0, 0xB}), 1};
inline const PortIdentity kUs{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
inline const PortIdentity kOther{ClockIdentity::from_mac({2, 0, 0, 0, 0, 2}), 1};
inline constexpr Nanoseconds kEpoch = 1'800'000'000s;
inline constexpr Nanoseconds kDelay = 10us;

inline FreeRunningTime local(Nanoseconds time) { return FreeRunningTime{Duration{time + 5s}}; }
inline ReferenceTime reference(Nanoseconds time) { return ReferenceTime{Duration{time + kEpoch}}; }

inline MessageBytes bytes_of(const Message& message) {
  const auto bytes = encode(message);
  EXPECT_TRUE(bytes.ok());
  return *bytes;
}

inline Message message_from(const PortIdentity& source, std::uint16_t sequence_id,
                            const Body& body) {
  Message message;
  message.header.source = source;
  message.header.sequence_id = sequence_id;
  message.header.log_interval = -3;
  message.body = body;
  return message;
}

inline Message announce_from(const PortIdentity& source, std::uint8_t priority1 = 128) {
  Announce announce;
  announce.grandmaster = source.clock;
  announce.priority1 = priority1;
  Message message = message_from(source, 0, announce);
  message.header.log_interval = 0;
  return message;
}

inline Message sync_from(const PortIdentity& source, std::uint16_t sequence_id) {
  Message message = message_from(source, sequence_id, Sync{});
  message.header.flags = flag::kTwoStep;
  return message;
}

class Receiver : public testing::Test {
 protected:
  explicit Receiver(const TimeReceiverConfig& config = default_config()) : receiver_(config) {
    static_cast<void>(receiver_.start(local(0s)));
  }
  static TimeReceiverConfig default_config() {
    TimeReceiverConfig config;
    config.port = kUs;
    config.log_min_delay_req_interval = -3;
    return config;
  }

  ActionList event(const Message& message, Nanoseconds at) {
    return receiver_.on_event_message(bytes_of(message).view(), local(at), local(at));
  }
  ActionList general(const Message& message, Nanoseconds at) {
    return receiver_.on_general_message(bytes_of(message).view(), local(at));
  }
  ActionList general(std::vector<std::uint8_t> octets, Nanoseconds at) {
    return receiver_.on_general_message(octets, local(at));
  }
  /// Sync of A that left at `sent`, and its Follow_Up.
  ActionList exchange(std::uint16_t sequence_id, Nanoseconds sent) {
    static_cast<void>(event(sync_from(kA, sequence_id), sent + kDelay));
    return general(follow_up(sequence_id, sent), sent + 2 * kDelay);
  }
  static Message follow_up(std::uint16_t sequence_id, Nanoseconds sent) {
    return message_from(kA, sequence_id, FollowUp{reference(sent)});
  }
  static Message delay_resp(std::uint16_t sequence_id, Nanoseconds received) {
    return message_from(kA, sequence_id, DelayResp{reference(received), kUs});
  }
  /// A announces twice: it is selected at `at` + 250 ms.
  void select_a(Nanoseconds at = 0s) {
    static_cast<void>(general(announce_from(kA), at));
    static_cast<void>(general(announce_from(kA), at + 250ms));
    ASSERT_NE(receiver_.transmitter(), nullptr);
    ASSERT_EQ(receiver_.transmitter()->port, kA);
  }
  [[nodiscard]] std::uint64_t count(Counter counter) const { return receiver_.counters()[counter]; }

  TimeReceiver receiver_;
};

}  // namespace ftcs::ptp::receiver_test
