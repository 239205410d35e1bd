// SPDX-License-Identifier: MIT
//
// The world of receiver_fixture.h, with receivers that are not of the default profile: peer to
// peer, IEEE 802.1AS, hybrid, with a table of acceptable transmitters, with a fast start.
#include "test/support/receiver_fixture.h"

namespace ftcs::ptp::receiver_test {
namespace {

/// kA is the neighbour too; the link takes kDelay, the turn-around a millisecond.
class PeerReceiver : public Receiver {
 protected:
  explicit PeerReceiver(const TimeReceiverConfig& config = peer_config()) : Receiver(config) {}
  static TimeReceiverConfig peer_config() {
    TimeReceiverConfig config = default_config();
    config.delay_mechanism = DelayMechanism::kPeerToPeer;
    return config;
  }
  std::vector<EmitPeerDelay> peer_exchange(Nanoseconds at) {
    const auto asked = of<SendMessage>(receiver_.on_timer(local(at)));
    if (asked.empty()) return {};
    EXPECT_EQ(asked[0].type, MessageType::kPdelayReq);
    static_cast<void>(receiver_.on_transmit_timestamp(asked[0].id(), local(at), local(at)));
    Message answer =
        message_from(kA, asked[0].sequence_id, PdelayResp{reference(at + kDelay), kUs});
    answer.header.flags = flag::kTwoStep;
    static_cast<void>(event(answer, at + 2 * kDelay + 1ms));
    return of<EmitPeerDelay>(
        general(message_from(kA, asked[0].sequence_id,
                             PdelayRespFollowUp{reference(at + kDelay + 1ms), kUs}),
                at + 3 * kDelay + 1ms));
  }
};

TEST_F(PeerReceiver, measures_the_link_before_anybody_transmits) {
  EXPECT_EQ(receiver_.deadline(), local(0s));
  const auto delays = peer_exchange(0s);
  ASSERT_EQ(delays.size(), 1U);
  EXPECT_EQ(delays[0].mean_link_delay, Duration{kDelay});
  EXPECT_EQ(receiver_.peer_delay().mean_link_delay(), Duration{kDelay});
  EXPECT_EQ(receiver_.deadline(), local(1s));
}

TEST_F(PeerReceiver, takes_pairs_from_sync_and_never_asks_for_an_end_to_end_delay) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  const auto actions = exchange(2, 2s);
  ASSERT_EQ(of<EmitPair>(actions).size(), 1U);
  EXPECT_EQ(count(Counter::kDelayReqSent), 0U);
  static_cast<void>(general(delay_resp(0, 2s), 2s));
  EXPECT_EQ(count(Counter::kDelayIgnored), 1U);
}

TEST_F(PeerReceiver, the_neighbours_stamps_count_while_it_is_the_transmitter) {
  EXPECT_FALSE(peer_exchange(0s).at(0).stamps);
  select_a();
  EXPECT_TRUE(peer_exchange(1s).at(0).stamps);
  static_cast<void>(general(announce_from(kB, 1), 2s));
  static_cast<void>(general(announce_from(kB, 1), 2s + 250ms));
  ASSERT_EQ(receiver_.transmitter()->port, kB);
  EXPECT_FALSE(peer_exchange(3s).at(0).stamps);
}

TEST_F(PeerReceiver, an_exchange_during_which_the_reference_jumps_is_void) {
  select_a();
  static_cast<void>(exchange(1, 500ms));
  const auto asked = of<SendMessage>(receiver_.on_timer(local(1s)));
  ASSERT_EQ(asked.size(), 1U);
  static_cast<void>(receiver_.on_transmit_timestamp(asked[0].id(), local(1s), local(1s)));
  Message answer = message_from(kA, asked[0].sequence_id, PdelayResp{reference(1s), kUs});
  answer.header.flags = flag::kTwoStep;
  static_cast<void>(event(answer, 1s + 1ms));
  for (std::uint16_t i = 2; i < 5; ++i) {
    const Nanoseconds at = 1s + (i - 1) * 500ms;
    static_cast<void>(event(sync_from(kA, i), at));
    ASSERT_EQ(of<ReferenceJumped>(general(follow_up(i, 10s + at), at)).size(), i < 4 ? 0U : 1U);
  }
  EXPECT_TRUE(of<EmitPeerDelay>(general(message_from(kA, asked[0].sequence_id,
                                                     PdelayRespFollowUp{reference(11s), kUs}),
                                        2s + 501ms))
                  .empty());
}

TEST_F(PeerReceiver, answers_its_neighbour) {
  const auto actions = event(message_from(kA, 9, PdelayReq{}), 1s);
  const auto answer = of<SendMessage>(actions);
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_EQ(answer[0].type, MessageType::kPdelayResp);
  const auto last = of<SendMessage>(
      receiver_.on_transmit_timestamp(answer[0].id(), local(1s + 1ms), local(1s + 1ms)));
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(last[0].type, MessageType::kPdelayRespFollowUp);
}

TEST_F(PeerReceiver, a_link_that_was_down_is_measured_anew) {
  ASSERT_EQ(peer_exchange(0s).size(), 1U);
  static_cast<void>(receiver_.on_link_down(local(1s)));
  EXPECT_FALSE(receiver_.deadline().has_value());
  static_cast<void>(receiver_.on_link_up(local(5s)));
  const auto delays = peer_exchange(5s);
  ASSERT_EQ(delays.size(), 1U);
  EXPECT_TRUE(delays[0].first);
}

/// IEEE 802.1AS: majorSdoId 1, and nothing is taken from a neighbour that is not capable.
class GptpReceiver : public PeerReceiver {
 protected:
  GptpReceiver() : PeerReceiver(gptp_config()) {}
  static TimeReceiverConfig gptp_config() {
    TimeReceiverConfig config = peer_config();
    config.major_sdo_id = 1;
    config.peer_delay.capability_needed = true;
    config.sync_receipt_timeout = 3;
    config.assume_two_step = true;
    return config;
  }
  static Message profile(Message message) {
    message.header.major_sdo_id = 1;
    return message;
  }
  /// Two exchanges: delay and rate are known. Then A is selected, at 2.25 s.
  void begin() {
    for (const Nanoseconds at : {0s, 1s}) gptp_exchange(at);
    ASSERT_TRUE(receiver_.peer_delay().capable());
    static_cast<void>(general(profile(announce_from(kA)), 2s));
    static_cast<void>(general(profile(announce_from(kA)), 2s + 250ms));
    ASSERT_NE(receiver_.transmitter(), nullptr);
  }
  void gptp_exchange(Nanoseconds at) {
    const auto asked = of<SendMessage>(receiver_.on_timer(local(at)));
    ASSERT_EQ(asked.size(), 1U);
    static_cast<void>(receiver_.on_transmit_timestamp(asked[0].id(), local(at), local(at)));
    // One-step by its flag: assume_two_step says otherwise.
    static_cast<void>(event(
        profile(message_from(kA, asked[0].sequence_id, PdelayResp{reference(at + kDelay), kUs})),
        at + 2 * kDelay + 1ms));
    static_cast<void>(
        general(profile(message_from(kA, asked[0].sequence_id,
                                     PdelayRespFollowUp{reference(at + kDelay + 1ms), kUs})),
                at + 3 * kDelay + 1ms));
  }
  ActionList informed_exchange(std::uint16_t id, Nanoseconds sent,
                               const FollowUpInformation& information) {
    static_cast<void>(event(profile(sync_from(kA, id)), sent + kDelay));
    FollowUp body{reference(sent)};
    body.has_information = true;
    body.information = information;
    return general(profile(message_from(kA, id, body)), sent + 2 * kDelay);
  }
};

TEST_F(GptpReceiver, listens_to_nobody_until_its_neighbour_is_capable) {
  static_cast<void>(general(profile(announce_from(kA)), 0s));
  static_cast<void>(event(profile(sync_from(kA, 0)), 0s));
  EXPECT_EQ(count(Counter::kNotCapable), 2U);
  begin();
}

TEST_F(GptpReceiver, knows_how_fast_the_grandmaster_is) {
  begin();
  EXPECT_FALSE(receiver_.grandmaster_rate_ratio().has_value());
  FollowUpInformation information;
  information.cumulative_scaled_rate_offset = 219'902'326;  // 1e-4 times 2^41
  EXPECT_EQ(of<EmitPair>(informed_exchange(1, 3s, information)).size(), 1U);
  ASSERT_TRUE(receiver_.grandmaster_rate_ratio().has_value());
  EXPECT_NEAR(receiver_.grandmaster_rate_ratio()->ppm(), 100.0, 1e-3);
  // The neighbour measured the link by its own clock: by the grandmaster's it is 100 ppm longer.
  const auto delays = [&] {
    const auto asked = of<SendMessage>(receiver_.on_timer(local(3s + 200ms)));
    EXPECT_EQ(asked.size(), 1U);
    const Nanoseconds at = 3s + 200ms;
    static_cast<void>(receiver_.on_transmit_timestamp(asked[0].id(), local(at), local(at)));
    static_cast<void>(event(
        profile(message_from(kA, asked[0].sequence_id, PdelayResp{reference(at + kDelay), kUs})),
        at + 2 * kDelay));
    return of<EmitPeerDelay>(
        general(profile(message_from(kA, asked[0].sequence_id,
                                     PdelayRespFollowUp{reference(at + kDelay), kUs})),
                at + 3 * kDelay));
  }();
  ASSERT_EQ(delays.size(), 1U);
  EXPECT_NEAR(delays[0].mean_link_delay.ns(), 10'001.0, 0.1);
  EXPECT_FALSE(delays[0].stamps) << "its clock runs freely";
}

TEST_F(GptpReceiver, is_told_of_jumps_that_it_could_not_see) {
  begin();
  FollowUpInformation information;
  EXPECT_TRUE(of<ReferenceJumped>(informed_exchange(1, 3s, information)).empty());
  information.gm_time_base_indicator = 1;
  information.last_gm_phase_change = Duration::from_ns(-250.5);
  const auto said = [&](std::uint16_t id) {
    return informed_exchange(id, id * 125ms + 3s, information);
  };
  for (std::uint16_t id = 2; id < 10; ++id) {
    EXPECT_TRUE(said(id).empty()) << "for less than a second it may be anybody's";
  }
  const auto actions = said(10);
  const auto jumps = of<ReferenceJumped>(actions);
  ASSERT_EQ(jumps.size(), 1U);
  EXPECT_EQ(of<EmitPair>(actions).size(), 1U);
  EXPECT_EQ(jumps[0].jump, Duration::from_ns(-250.5));
  EXPECT_TRUE(of<ReferenceJumped>(said(11)).empty());
  EXPECT_EQ(count(Counter::kReferenceJumps), 1U);
}

TEST_F(GptpReceiver, information_without_a_sync_is_not_believed) {
  begin();
  FollowUpInformation information;
  static_cast<void>(informed_exchange(1, 3s, information));
  information.gm_time_base_indicator = 1;
  FollowUp body{reference(3s + 100ms)};
  body.has_information = true;
  body.information = information;
  for (std::uint16_t id = 1; id <= 3; ++id) {
    EXPECT_TRUE(
        of<ReferenceJumped>(general(profile(message_from(kA, id, body)), 3s + 100ms)).empty());
  }
}

TEST_F(GptpReceiver, a_transmitter_without_syncs_is_given_up_while_it_still_announces) {
  begin();
  static_cast<void>(informed_exchange(1, 3s, {}));
  EXPECT_EQ(receiver_.deadline(), local(2s));  // the next peer delay request
  gptp_exchange(3s + 100ms);
  EXPECT_EQ(receiver_.deadline(), local(3s + 3 * 125ms + kDelay));
  const auto changes = of<PortStateChanged>(receiver_.on_timer(local(3s + 3 * 125ms + kDelay)));
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].to, PortState::kListening);
  EXPECT_EQ(count(Counter::kSyncTimeouts), 1U);
}

class HybridReceiver : public Receiver {
 protected:
  HybridReceiver() : Receiver(hybrid_config()) {}
  static TimeReceiverConfig hybrid_config() {
    TimeReceiverConfig config = default_config();
    config.hybrid = true;
    return config;
  }
};

TEST_F(HybridReceiver, asks_the_transmitter_itself_at_the_address_its_syncs_come_from) {
  select_a();
  const auto actions = event(sync_from(kA, 1), 1s);
  EXPECT_EQ(of<SenderIsTransmitter>(actions).size(), 1U);
  const auto sent = of<SendMessage>(actions);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].destination, Destination::kTransmitter);
  EXPECT_TRUE(decode(sent[0].bytes.view())->header.has(flag::kUnicast));
  EXPECT_TRUE(of<SenderIsTransmitter>(event(sync_from(kB, 1), 1s)).empty());
}

class ChoosyReceiver : public Receiver {
 protected:
  ChoosyReceiver() : Receiver(choosy_config()) {}
  static TimeReceiverConfig choosy_config() {
    TimeReceiverConfig config = default_config();
    EXPECT_TRUE(config.acceptable.add(kA.clock));
    config.fast_start = true;
    return config;
  }
};

TEST_F(ChoosyReceiver, follows_only_whom_it_was_told_to_however_good_the_other_is) {
  static_cast<void>(event(sync_from(kB, 1), 0s));
  for (int i = 0; i < 3; ++i) static_cast<void>(general(announce_from(kB, 1), 250ms * i));
  EXPECT_EQ(receiver_.transmitter(), nullptr);
  EXPECT_EQ(count(Counter::kUnacceptableTransmitter), 4U);
  static_cast<void>(general(announce_from(kA, 200), 1s));
  ASSERT_NE(receiver_.transmitter(), nullptr);
  EXPECT_EQ(receiver_.transmitter()->port, kA);
}

TEST(AcceptableTransmitters, has_sixteen_places) {
  AcceptableTransmitters table;
  EXPECT_TRUE(table.accepts(kA.clock)) << "an empty one accepts everybody";
  for (std::uint8_t i = 0; i < AcceptableTransmitters::kCapacity; ++i) {
    EXPECT_TRUE(table.add(ClockIdentity::from_mac({9, 9, 9, 9, 9, i})));
  }
  EXPECT_FALSE(table.add(kA.clock));
  EXPECT_FALSE(table.accepts(kA.clock));
}

class FastReceiver : public Receiver {
 protected:
  FastReceiver() : Receiver(fast_config()) {}
  static TimeReceiverConfig fast_config() {
    TimeReceiverConfig config = default_config();
    config.fast_start = true;
    return config;
  }
};

TEST_F(FastReceiver, the_first_announce_selects) {
  const auto actions = general(announce_from(kA), 0s);
  EXPECT_EQ(of<TransmitterSelected>(actions).size(), 1U);
  // A change of the transmitter takes two, as ever.
  static_cast<void>(general(announce_from(kB, 1), 100ms));
  EXPECT_EQ(receiver_.transmitter()->port, kA);
  static_cast<void>(general(announce_from(kB, 1), 200ms));
  EXPECT_EQ(receiver_.transmitter()->port, kB);
}

TEST_F(FastReceiver, what_was_measured_before_the_announce_is_emitted_with_it_in_order) {
  const auto asked = of<SendMessage>(event(sync_from(kA, 1), kDelay));
  ASSERT_EQ(asked.size(), 1U) << "it asks for the delay at once";
  EXPECT_TRUE(of<EmitPair>(general(follow_up(1, 0s), 2 * kDelay)).empty());
  static_cast<void>(receiver_.on_transmit_timestamp(asked[0].id(), local(1ms), local(1ms)));
  EXPECT_TRUE(of<EmitPair>(general(delay_resp(asked[0].sequence_id, 1ms + kDelay), 2ms)).empty());
  static_cast<void>(exchange(2, 125ms));
  EXPECT_EQ(count(Counter::kForwardPairs), 0U);
  EXPECT_EQ(receiver_.state(), PortState::kListening);

  const auto pairs = of<EmitPair>(general(announce_from(kA), 200ms));
  ASSERT_EQ(pairs.size(), 3U);
  EXPECT_EQ(pairs[0].pair.direction, Direction::kForward);
  EXPECT_EQ(pairs[0].pair.reference, reference(0s));
  EXPECT_EQ(pairs[1].pair.direction, Direction::kBackward);
  EXPECT_EQ(pairs[2].pair.reference, reference(125ms));
  EXPECT_EQ(count(Counter::kForwardPairs), 2U);
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
  // The exchange goes on where it was.
  EXPECT_EQ(of<EmitPair>(exchange(3, 250ms)).size(), 1U);
}

TEST_F(FastReceiver, what_another_one_sent_is_worth_nothing) {
  static_cast<void>(exchange(1, 0s));
  static_cast<void>(event(sync_from(kB, 1), 10ms));  // not the candidate
  EXPECT_EQ(count(Counter::kNotListening), 1U);
  EXPECT_TRUE(of<EmitPair>(general(announce_from(kB), 20ms)).empty());
  EXPECT_EQ(receiver_.transmitter()->port, kB);
  EXPECT_EQ(count(Counter::kForwardPairs), 0U);
}

TEST_F(FastReceiver, a_candidate_that_falls_silent_makes_room) {
  static_cast<void>(exchange(1, 0s));
  static_cast<void>(event(sync_from(kB, 7), 5s));
  EXPECT_EQ(count(Counter::kSyncReceived), 2U);
  static_cast<void>(general(follow_up(1, 5s), 5s));  // of A, who is out
  EXPECT_EQ(count(Counter::kNotListening), 1U);
}

TEST_F(FastReceiver, only_the_newest_pairs_are_kept_and_none_from_before_a_jump) {
  for (std::uint16_t i = 0; i < 9; ++i) static_cast<void>(exchange(i, 125ms * i));
  for (std::uint16_t i = 9; i < 18; ++i) {
    static_cast<void>(event(sync_from(kA, i), i * 125ms));
    static_cast<void>(general(follow_up(i, i * 125ms + 37s), i * 125ms));
  }
  const auto actions = general(announce_from(kA), 3s);
  EXPECT_TRUE(of<ReferenceJumped>(actions).empty());
  ASSERT_EQ(of<EmitPair>(actions).size(), 1U) << "the one with which the new time was believed";
  EXPECT_EQ(of<EmitPair>(actions)[0].pair.reference, reference(17 * 125ms + 37s));
}

TEST_F(FastReceiver, a_full_list_of_actions_is_not_too_long) {
  for (std::uint16_t i = 0; i < 9; ++i) static_cast<void>(exchange(i, 125ms * i));
  EXPECT_EQ(general(announce_from(kA), 2s).size(), 7U);
  EXPECT_EQ(count(Counter::kActionsDropped), 0U);
}

}  // namespace
}  // namespace ftcs::ptp::receiver_test
