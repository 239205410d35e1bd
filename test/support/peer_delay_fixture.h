// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/peer_delay.h"
#include "test/support/actions.h"

namespace ftcs::ptp::peer_delay_test {

using namespace std::chrono_literals;

inline const PortIdentity kUs{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
inline const PortIdentity kNeighbour{ClockIdentity::from_mac({2, 0, 0, 0, 0, 2}), 1};
inline const PortIdentity kStranger{ClockIdentity::from_mac({2, 0, 0, 0, 0, 3}), 1};
inline constexpr Nanoseconds kLink = 700ns;
inline constexpr Nanoseconds kTurnAround = 10ms;

inline FreeRunningTime ours(Nanoseconds time) { return FreeRunningTime{Duration{time + 77s}}; }
inline ReferenceTime neighbours(Nanoseconds time) {
  return ReferenceTime{scale(Duration{time}, Rate::from_ppm(100.0)) + Duration{1'800'000'000s}};
}

/// The world: our port and its neighbour, 700 ns of cable apart. The neighbour's clock began at
/// another time and is 100 ppm fast; it answers 10 ms after it was asked, unless a test says
/// otherwise. All messages pass as octets.
class PeerDelayTest : public testing::Test {
 protected:
  explicit PeerDelayTest(const PeerDelayConfig& config = {}) : peer_(config) {
    ActionList ignored;
    port_.change_state(PortState::kListening, PortEvent::kInitComplete, ignored);
    peer_.start(ours(0s));
  }

  /// Sends the request that is due; its sequence id.
  std::uint16_t ask(Nanoseconds at) {
    ActionList actions;
    peer_.on_timer(ours(at), port_, actions);
    const auto sent = of<SendMessage>(actions);
    EXPECT_EQ(sent.size(), 1U);
    if (sent.empty()) return 0;
    EXPECT_EQ(sent[0].destination, Destination::kNeighbour);
    EXPECT_EQ(sent[0].type, MessageType::kPdelayReq);
    return sent[0].sequence_id;
  }
  ActionList stamp(std::uint16_t sequence_id, Nanoseconds at) {
    ActionList actions;
    peer_.on_sent({MessageType::kPdelayReq, sequence_id, {}}, ours(at), port_, actions);
    return actions;
  }
  ActionList hand_over(const Message& message, Nanoseconds at) {
    ActionList actions;
    const auto bytes = encode(message);
    EXPECT_TRUE(bytes.ok());
    if (const auto read = port_.read(bytes->view())) {
      peer_.on_message(*read, ours(at), port_, actions);
    }
    return actions;
  }
  static Message message(std::uint16_t sequence_id, const Body& body,
                         const PortIdentity& source = kNeighbour) {
    Message message;
    message.header.source = source;
    message.header.sequence_id = sequence_id;
    message.body = body;
    return message;
  }
  static Message response(std::uint16_t sequence_id, Nanoseconds received,
                          const PortIdentity& source = kNeighbour) {
    Message answer = message(sequence_id, PdelayResp{neighbours(received), kUs}, source);
    answer.header.flags = flag::kTwoStep;
    return answer;
  }
  static Message follow_up(std::uint16_t sequence_id, Nanoseconds sent,
                           const PortIdentity& source = kNeighbour) {
    return message(sequence_id, PdelayRespFollowUp{neighbours(sent), kUs}, source);
  }
  /// A whole exchange that begins at `at`.
  std::vector<EmitPeerDelay> exchange(Nanoseconds at, const PortIdentity& source = kNeighbour) {
    const std::uint16_t id = ask(at);
    static_cast<void>(stamp(id, at));
    const Nanoseconds left = at + kLink + kTurnAround;
    static_cast<void>(hand_over(response(id, at + kLink, source), left + kLink));
    return of<EmitPeerDelay>(hand_over(follow_up(id, left, source), left + 2 * kLink));
  }
  [[nodiscard]] std::uint64_t count(Counter counter) const { return port_.counters()[counter]; }

  Port port_{PortConfig{.identity = kUs}};
  PeerDelay peer_;
};

}  // namespace ftcs::ptp::peer_delay_test
