// SPDX-License-Identifier: MIT
//
// The world: receiver_fixture.h. Each test of a mishap names its counter and shows the reaction.
#include <vector>

#include <gtest/gtest.h>

#include "test/support/receiver_fixture.h"

namespace ftcs::ptp::receiver_test {
namespace {

// Order and loss.

TEST_F(Receiver, follow_up_before_sync_is_kept) {
  select_a();
  EXPECT_TRUE(of<EmitPair>(general(follow_up(3, 1s), 1s)).empty());
  EXPECT_EQ(of<EmitPair>(event(sync_from(kA, 3), 1s + kDelay)).size(), 1U);
}

TEST_F(Receiver, lost_follow_up_is_counted_and_harms_nothing) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  EXPECT_EQ(of<EmitPair>(exchange(2, 1125ms)).size(), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(3, 2500ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kLostFollowUp), 1U);
  EXPECT_TRUE(of<EmitPair>(general(follow_up(1, 1s), 2600ms)).empty()) << "too late";
  EXPECT_EQ(count(Counter::kStaleFollowUp), 1U);
}

TEST_F(Receiver, follow_up_of_a_forgotten_sync_is_stale) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  EXPECT_TRUE(general(follow_up(1, 1s), 2s + 1ns).empty());
  EXPECT_EQ(count(Counter::kLostFollowUp), 1U);
  EXPECT_EQ(count(Counter::kStaleFollowUp), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(2, 3s)).size(), 1U);
}

TEST_F(Receiver, lost_sync_is_counted_and_its_follow_up_forgotten) {
  select_a();
  static_cast<void>(exchange(1, 1s));
  static_cast<void>(general(follow_up(2, 1125ms), 1125ms));
  EXPECT_EQ(of<EmitPair>(exchange(3, 1250ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kMissedSync), 1U);
  static_cast<void>(exchange(4, 2500ms));
  EXPECT_EQ(count(Counter::kLostSync), 1U);
}

TEST_F(Receiver, duplicates_are_dropped) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  static_cast<void>(event(sync_from(kA, 1), 1s + 50us));
  EXPECT_EQ(count(Counter::kDuplicateSync), 1U);
  const auto pairs = of<EmitPair>(general(follow_up(1, 1s), 1s + 60us));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.free_running, local(1s)) << "the first copy counts";
  EXPECT_TRUE(general(follow_up(1, 1s), 1s + 70us).empty());
  EXPECT_EQ(count(Counter::kDuplicateFollowUp), 1U);
  EXPECT_TRUE(of<EmitPair>(event(sync_from(kA, 1), 1s + 80us)).empty());
  EXPECT_EQ(count(Counter::kDuplicateSync), 2U);
}

TEST_F(Receiver, syncs_older_than_the_newest_are_dropped) {
  select_a();
  static_cast<void>(exchange(5, 1s));
  static_cast<void>(event(sync_from(kA, 4), 1s + 1ms));
  EXPECT_TRUE(of<EmitPair>(general(follow_up(4, 875ms), 1s + 1ms)).empty());
  EXPECT_EQ(count(Counter::kStaleSync), 1U);
  EXPECT_EQ(count(Counter::kStaleFollowUp), 1U);
}

TEST_F(Receiver, a_stale_one_step_sync_is_dropped_as_well) {
  select_a();
  static_cast<void>(exchange(5, 1s));
  EXPECT_TRUE(of<EmitPair>(event(message_from(kA, 4, Sync{reference(875ms)}), 1s + 1ms)).empty());
  EXPECT_EQ(count(Counter::kStaleSync), 1U);
  EXPECT_EQ(count(Counter::kStaleFollowUp), 0U);
}

TEST_F(Receiver, sixteen_ids_ahead_are_loss_and_any_other_id_is_a_restart_once_it_goes_on) {
  select_a();
  const auto pairs = [this](std::uint16_t id, Nanoseconds at) {
    return of<EmitPair>(exchange(id, at)).size();
  };
  EXPECT_EQ(pairs(100, 1s), 1U);
  EXPECT_EQ(pairs(85, 1125ms), 0U) << "15 back";
  EXPECT_EQ(pairs(116, 1250ms), 1U) << "16 ahead: loss";
  EXPECT_EQ(count(Counter::kMissedSync), 15U);
  EXPECT_EQ(pairs(133, 1375ms), 0U) << "17 ahead: a stray";
  EXPECT_EQ(pairs(117, 1500ms), 1U);
  EXPECT_EQ(count(Counter::kSequenceRestarts), 0U);
  EXPECT_EQ(pairs(50, 1625ms), 0U);
  EXPECT_EQ(pairs(51, 1750ms), 0U);
  EXPECT_EQ(pairs(52, 1875ms), 1U) << "three in a row: a restart";
  EXPECT_EQ(pairs(53, 2s), 1U);
  EXPECT_EQ(count(Counter::kSequenceRestarts), 1U);
  EXPECT_EQ(count(Counter::kMissedSync), 15U);
}

// Two frames a second made every true Sync stale, for as long as they came.
TEST_F(Receiver, ids_that_somebody_pushes_ahead_do_not_lock_the_transmitter_out) {
  select_a();
  std::size_t heard = 0;
  constexpr int kSyncs = 480;  // a minute
  for (int i = 0; i < kSyncs; ++i) {
    const Nanoseconds at = 1s + i * 125ms;
    const auto id = static_cast<std::uint16_t>(i);
    for (const EmitPair& emitted : of<EmitPair>(exchange(id, at))) {
      heard += emitted.pair.reference == reference(at) ? 1U : 0U;
    }
    if (i % 4 == 0) {
      const auto ahead = static_cast<std::uint16_t>(id + 12);
      static_cast<void>(event(message_from(kA, ahead, Sync{reference(at)}), at + 60ms));
    }
  }
  EXPECT_GT(heard, kSyncs * 9U / 10U);
}

// One old pair a second, again and again: each was taken for a restarted transmitter.
TEST_F(Receiver, replayed_pairs_are_no_restart) {
  select_a();
  for (int i = 0; i < 160; ++i) {
    const Nanoseconds at = 1s + i * 125ms;
    const auto id = static_cast<std::uint16_t>(i);
    EXPECT_EQ(of<EmitPair>(exchange(id, at)).size(), 1U) << i;
    if (i < 40 || i % 8 != 0) continue;
    const auto old = static_cast<std::uint16_t>(i - 20 - i % 16);
    static_cast<void>(event(sync_from(kA, old), at + 60ms));
    EXPECT_TRUE(of<EmitPair>(general(follow_up(old, at - 2500ms), at + 61ms)).empty()) << i;
  }
  EXPECT_EQ(count(Counter::kSequenceRestarts), 0U);
}

TEST_F(Receiver, pairs_never_go_back_in_sequence) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  static_cast<void>(event(sync_from(kA, 2), 1125ms));
  EXPECT_EQ(of<EmitPair>(general(follow_up(2, 1125ms), 1200ms)).size(), 1U);
  EXPECT_TRUE(of<EmitPair>(general(follow_up(1, 1s), 1201ms)).empty());
  EXPECT_EQ(count(Counter::kStaleFollowUp), 1U);
}

TEST_F(Receiver, sequence_ids_wrap) {
  select_a();
  EXPECT_EQ(of<EmitPair>(exchange(65535, 1s)).size(), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(0, 1125ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kMissedSync), 0U);
  EXPECT_EQ(count(Counter::kSequenceRestarts), 0U);
}

TEST_F(Receiver, a_transmitter_that_restarts_is_followed_again_with_its_third_sync) {
  select_a();
  static_cast<void>(exchange(5000, 1s));
  static_cast<void>(event(sync_from(kA, 5001), 1125ms));
  EXPECT_TRUE(of<EmitPair>(exchange(0, 1250ms)).empty());
  EXPECT_TRUE(of<EmitPair>(exchange(1, 1375ms)).empty());
  EXPECT_EQ(of<EmitPair>(exchange(2, 1500ms)).size(), 1U);
  EXPECT_EQ(count(Counter::kSequenceRestarts), 1U);
  EXPECT_EQ(count(Counter::kLostFollowUp), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(3, 3s)).size(), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(0, 5s)).size(), 1U)
      << "after a pause even a near id is a restart";
}

TEST_F(Receiver, a_request_without_answer_is_counted_and_asked_again) {
  select_a();
  static_cast<void>(event(sync_from(kA, 0), 1s));
  auto now = local(1s);
  for (int i = 0; i < 4; ++i) {
    static_cast<void>(receiver_.on_general_message(bytes_of(announce_from(kA)).view(), now));
    now = *receiver_.deadline();
    static_cast<void>(receiver_.on_timer(now));
  }
  EXPECT_EQ(count(Counter::kLostDelayResp), 1U);
  EXPECT_EQ(count(Counter::kDelayReqSent), 5U);
}

TEST_F(Receiver, late_and_duplicate_delay_responses_are_dropped) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  static_cast<void>(
      receiver_.on_transmit_timestamp({MessageType::kDelayReq, id}, local(1s), local(1s)));
  EXPECT_EQ(of<EmitPair>(general(delay_resp(id, 1s), 1s)).size(), 1U);
  EXPECT_TRUE(general(delay_resp(id, 1s), 1s).empty());
  const auto never_sent = static_cast<std::uint16_t>(id + 1);
  EXPECT_TRUE(general(delay_resp(never_sent, 1s), 1s).empty());
  EXPECT_EQ(count(Counter::kStaleDelayResp), 2U);
}

TEST_F(Receiver, a_missing_transmit_stamp_leaves_the_exchange_out) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  EXPECT_TRUE(
      receiver_.on_transmit_timestamp_missing({MessageType::kDelayReq, id}, local(1s)).empty());
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U);
  EXPECT_TRUE(general(delay_resp(id, 1s), 1s).empty());
  EXPECT_TRUE(receiver_.deadline().has_value()) << "the next request comes as planned";
  for (int i = 0; i < 4; ++i) static_cast<void>(receiver_.on_timer(*receiver_.deadline()));
  EXPECT_EQ(count(Counter::kMissingTransmitStamp), 1U) << "counted once";
  EXPECT_EQ(count(Counter::kLostDelayResp), 0U) << "the answer came";
  static_cast<void>(
      receiver_.on_transmit_timestamp({MessageType::kDelayReq, id}, local(1s), local(9s)));
  EXPECT_EQ(count(Counter::kUnexpectedTransmitStamp), 1U) << "four requests later";
}

// A driver that is slow with its stamps is slower than tx_timestamp_timeout with each of them.
TEST_F(Receiver, a_transmit_stamp_that_comes_after_its_timeout_is_used) {
  select_a();
  auto asked = of<SendMessage>(event(sync_from(kA, 0), 1s));
  for (const bool answered_first : {true, false}) {
    ASSERT_EQ(asked.size(), 1U);
    const auto id = asked[0].sequence_id;
    static_cast<void>(
        receiver_.on_transmit_timestamp_missing({MessageType::kDelayReq, id}, local(1s)));
    if (answered_first) {
      EXPECT_TRUE(general(delay_resp(id, 1s), 1s).empty());
    }
    auto pairs = of<EmitPair>(
        receiver_.on_transmit_timestamp({MessageType::kDelayReq, id}, local(900ms), local(1s)));
    if (!answered_first) {
      EXPECT_TRUE(pairs.empty());
      pairs = of<EmitPair>(general(delay_resp(id, 1s), 1s));
    }
    ASSERT_EQ(pairs.size(), 1U);
    EXPECT_EQ(pairs[0].pair.direction, Direction::kBackward);
    EXPECT_EQ(pairs[0].pair.free_running, local(900ms));
    asked = of<SendMessage>(receiver_.on_timer(*receiver_.deadline()));
  }
  EXPECT_EQ(count(Counter::kUnexpectedTransmitStamp), 0U);
  EXPECT_EQ(count(Counter::kLostDelayResp), 0U);
}

// Messages that are not for us.

TEST_F(Receiver, foreign_domains_and_profiles_are_ignored) {
  select_a();
  Message sync = sync_from(kA, 1);
  sync.header.domain = 1;
  EXPECT_TRUE(event(sync, 1s).empty());
  EXPECT_EQ(count(Counter::kWrongDomain), 1U);
  sync.header.domain = 0;
  sync.header.major_sdo_id = 1;  // IEEE 802.1AS
  EXPECT_TRUE(event(sync, 1s).empty());
  EXPECT_EQ(count(Counter::kWrongSdo), 1U);
  EXPECT_EQ(count(Counter::kSyncReceived), 0U);
}

TEST_F(Receiver, only_the_selected_transmitter_is_heard) {
  select_a();
  EXPECT_TRUE(event(sync_from(kB, 1), 1s).empty());
  EXPECT_TRUE(general(message_from(kB, 1, FollowUp{reference(1s)}), 1s).empty());
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  EXPECT_TRUE(general(message_from(kB, id, DelayResp{reference(1s), kUs}), 1s).empty());
  EXPECT_EQ(count(Counter::kWrongTransmitter), 3U);
}

TEST_F(Receiver, responses_to_other_receivers_are_ignored) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  static_cast<void>(
      receiver_.on_transmit_timestamp({MessageType::kDelayReq, id}, local(1s), local(1s)));
  EXPECT_TRUE(general(message_from(kA, id, DelayResp{reference(1s), kOther}), 1s).empty());
  EXPECT_EQ(count(Counter::kWrongRequestingPort), 1U);
  EXPECT_EQ(of<EmitPair>(general(delay_resp(id, 1s), 1s)).size(), 1U) << "ours is still open";
}

TEST_F(Receiver, syncs_before_a_transmitter_is_selected_are_ignored) {
  EXPECT_TRUE(event(sync_from(kA, 1), 1s).empty());
  EXPECT_EQ(count(Counter::kNotListening), 1U);
}

TEST_F(Receiver, other_roles_messages_are_recognised_and_left_alone) {
  select_a();
  EXPECT_TRUE(event(message_from(kOther, 1, DelayReq{}), 1s).empty());
  EXPECT_TRUE(event(message_from(kUs, 1, DelayReq{}), 1s).empty());
  EXPECT_TRUE(event(message_from(kA, 1, PdelayReq{}), 1s).empty());
  EXPECT_TRUE(event(message_from(kA, 1, PdelayResp{}), 1s).empty());
  EXPECT_TRUE(general(message_from(kA, 1, PdelayRespFollowUp{}), 1s).empty());
  EXPECT_TRUE(general(message_from(kA, 1, Signaling{}), 1s).empty());
  EXPECT_TRUE(general(message_from(kA, 1, Management{}), 1s).empty());
  EXPECT_TRUE(general(sync_from(kA, 1), 1s).empty()) << "no receive stamp on the general port";
  Message alternate = announce_from(kB);
  alternate.header.flags = flag::kAlternateTransmitter;
  EXPECT_TRUE(general(alternate, 1s).empty());
  EXPECT_EQ(count(Counter::kNotForThisRole), 1U);
  EXPECT_EQ(count(Counter::kOwnMessage), 1U);
  EXPECT_EQ(count(Counter::kPdelayIgnored), 3U);
  EXPECT_EQ(count(Counter::kSignalingIgnored), 1U);
  EXPECT_EQ(count(Counter::kManagementIgnored), 1U);
  EXPECT_EQ(count(Counter::kWrongChannel), 1U);
  EXPECT_EQ(count(Counter::kAlternateTransmitter), 1U);
}

// Messages that are broken.

TEST_F(Receiver, each_kind_of_broken_message_has_its_counter_and_no_effect) {
  select_a();
  const auto bytes = bytes_of(follow_up(1, 1s));
  const std::vector<std::uint8_t> good(bytes.view().begin(), bytes.view().end());
  const auto broken = [&](std::size_t offset, std::uint8_t value) {
    auto octets = good;
    octets[offset] = value;
    return octets;
  };
  auto oversized = good;
  oversized.resize(kMaximumMessageSize + 1);
  auto with_tlv = good;
  with_tlv.insert(with_tlv.end(), {0, 8, 0, 9, 1, 2});
  with_tlv[3] = static_cast<std::uint8_t>(with_tlv.size());
  const struct {
    std::vector<std::uint8_t> octets;
    Counter counter;
  } kCases[] = {{{}, Counter::kTruncated},
                {{good.begin(), good.begin() + 43}, Counter::kTruncated},
                {oversized, Counter::kOversized},
                {broken(1, 0x11), Counter::kWrongVersion},
                {broken(0, 0x07), Counter::kUnknownType},
                {broken(3, 43), Counter::kWrongLength},
                {broken(34, 0xFF), Counter::kBadTimestamp},
                {broken(40, 0xFF), Counter::kBadTimestamp},
                {with_tlv, Counter::kMalformedTlv}};
  static_cast<void>(event(sync_from(kA, 1), 1s));
  for (const auto& one : kCases) {
    const auto before = count(one.counter);
    EXPECT_TRUE(general(one.octets, 1s).empty());
    EXPECT_EQ(count(one.counter), before + 1) << to_string(one.counter);
  }
  EXPECT_EQ(of<EmitPair>(general(good, 1s)).size(), 1U) << "the good one is still awaited";
}

}  // namespace
}  // namespace ftcs::ptp::receiver_test
