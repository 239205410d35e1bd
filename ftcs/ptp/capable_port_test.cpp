// SPDX-License-Identifier: MIT
//
// The world: peer_delay_fixture.h. When a port of IEEE 802.1AS takes its neighbour for capable.
#include <gtest/gtest.h>

#include "test/support/peer_delay_fixture.h"

namespace ftcs::ptp::peer_delay_test {
namespace {

class CapablePort : public PeerDelayTest {
 protected:
  CapablePort() : PeerDelayTest(config()) {}
  static PeerDelayConfig config() {
    PeerDelayConfig config;
    config.capability_needed = true;
    config.highest = 800ns;
    config.allowed_losses = 3;
    return config;
  }
};

TEST_F(CapablePort, needs_an_answer_and_a_rate) {
  EXPECT_FALSE(peer_.capable());
  static_cast<void>(exchange(0s));
  EXPECT_FALSE(peer_.capable()) << "no rate yet";
  static_cast<void>(exchange(1s));
  EXPECT_TRUE(peer_.capable());
}

TEST_F(CapablePort, a_delay_above_the_threshold_is_a_bridge_that_speaks_no_802_1as) {
  static_cast<void>(exchange(0s));
  static_cast<void>(exchange(1s));
  const auto id = ask(2s);
  static_cast<void>(stamp(id, 2s));
  const Nanoseconds left = 2s + 900ns + kTurnAround;
  static_cast<void>(hand_over(response(id, 2s + 900ns), left + 900ns));
  static_cast<void>(hand_over(follow_up(id, left), left + 1us));
  EXPECT_FALSE(peer_.capable());
  static_cast<void>(exchange(3s));
  EXPECT_TRUE(peer_.capable());
}

TEST_F(CapablePort, is_lost_with_the_answers) {
  static_cast<void>(exchange(0s));
  static_cast<void>(exchange(1s));
  for (int i = 2; i < 6; ++i) {
    EXPECT_TRUE(peer_.capable()) << i;
    static_cast<void>(stamp(ask(1s * i), 1s * i));
  }
  static_cast<void>(ask(6s));
  EXPECT_FALSE(peer_.capable());
}

}  // namespace
}  // namespace ftcs::ptp::peer_delay_test
