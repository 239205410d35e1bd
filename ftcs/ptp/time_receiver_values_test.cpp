// SPDX-License-Identifier: MIT
//
// The world: receiver_fixture.h. Well-formed messages whose values must not be believed:
// corrections, intervals, and times that contradict each other.
#include <vector>

#include <gtest/gtest.h>

#include "test/support/receiver_fixture.h"

namespace ftcs::ptp::receiver_test {
namespace {

TEST_F(Receiver, small_negative_corrections_are_used_and_counted) {
  select_a();
  static_cast<void>(event(sync_from(kA, 1), 1s));
  Message follow = follow_up(1, 1s);
  follow.header.correction = Duration{-20ns};
  const auto pairs = of<EmitPair>(general(follow, 1s));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pair.reference, reference(1s) - Duration{20ns});
  EXPECT_EQ(count(Counter::kNegativeCorrection), 1U);
}

TEST_F(Receiver, the_fraction_of_a_stamp_in_a_delay_resp_is_no_negative_correction) {
  select_a();
  static_cast<void>(exchange(1, 1s));
  static_cast<void>(
      receiver_.on_transmit_timestamp({MessageType::kDelayReq, 0}, local(1s), local(1s)));
  Message response = delay_resp(0, 1s + kDelay);
  response.header.correction = -Duration::from_ns(0.75);
  ASSERT_EQ(of<EmitPair>(general(response, 1s + 2 * kDelay)).size(), 1U);
  EXPECT_EQ(count(Counter::kNegativeCorrection), 0U);
}

// One frame kept us from measuring the delay for up to 256 s.
TEST_F(Receiver, an_interval_is_demanded_by_the_answer_to_a_request_alone_and_within_limits) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  const Duration before = receiver_.delay_request_interval();
  Message unasked = delay_resp(static_cast<std::uint16_t>(id + 1), 1s);
  unasked.header.log_interval = 4;
  static_cast<void>(general(unasked, 1s));
  EXPECT_EQ(receiver_.delay_request_interval(), before);
  Message endless = delay_resp(id, 1s);
  endless.header.log_interval = 7;
  static_cast<void>(general(endless, 1s));
  EXPECT_EQ(receiver_.delay_request_interval(), before);
  EXPECT_EQ(count(Counter::kBadInterval), 1U);
}

// 250 jumps a second made 255 requests a second.
TEST_F(Receiver, a_reference_that_jumps_with_each_sync_is_not_asked_more_often) {
  select_a();
  std::size_t asked = 0;
  constexpr int kSyncs = 2'500;  // ten seconds
  for (int i = 0; i < kSyncs; ++i) {
    const Nanoseconds at = 1s + i * 4ms;
    const Nanoseconds told = at + (i % 2 == 0 ? 0s : 3s);
    const auto id = static_cast<std::uint16_t>(i);
    asked += of<SendMessage>(event(message_from(kA, id, Sync{reference(told)}), at)).size();
    if (receiver_.deadline() <= local(at)) {
      asked += of<SendMessage>(receiver_.on_timer(local(at))).size();
    }
    if (i % 250 == 0) static_cast<void>(general(announce_from(kA), at));
  }
  EXPECT_GT(asked, 40U);
  EXPECT_LT(asked, 170U) << "eight a second, and one more for a jump within each interval";
}

// One Follow_Up without a Sync reset the servo, also where 802.1AS is not spoken.
TEST_F(Receiver, information_in_a_follow_up_is_802_1as_alone) {
  select_a();
  for (std::uint16_t i = 0; i < 4; ++i) {
    static_cast<void>(event(sync_from(kA, i), 1s + i * 125ms));
    Message informed = follow_up(i, 1s + i * 125ms);
    auto& body = *std::get_if<FollowUp>(&informed.body);
    body.has_information = true;
    body.information.gm_time_base_indicator = i;
    EXPECT_TRUE(of<ReferenceJumped>(general(informed, 1s + i * 125ms + kDelay)).empty());
  }
  EXPECT_FALSE(receiver_.grandmaster_rate_ratio().has_value());
}

TEST_F(Receiver, corrections_of_more_than_a_second_are_refused) {
  select_a();
  for (const Duration absurd :
       {Duration{1s + 1ns}, Duration{-1s - 1ns}, Duration{39h}, Duration{-39h}}) {
    const auto before = count(Counter::kAbsurdCorrection);
    Message sync = sync_from(kA, 1);
    sync.header.correction = absurd;
    EXPECT_TRUE(event(sync, 1s).empty());
    Message follow = follow_up(1, 1s);
    follow.header.correction = absurd;
    EXPECT_TRUE(general(follow, 1s).empty());
    Message response = delay_resp(0, 1s);
    response.header.correction = absurd;
    EXPECT_TRUE(general(response, 1s).empty());
    EXPECT_EQ(count(Counter::kAbsurdCorrection), before + 3);
  }
  Message sync = message_from(kA, 1, Sync{reference(1s)});
  sync.header.correction = Duration{1s};
  EXPECT_EQ(of<EmitPair>(event(sync, 1s)).size(), 1U) << "the limit itself is allowed";
}

TEST_F(Receiver, a_jump_of_the_reference_is_reported_and_open_requests_are_forgotten) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  static_cast<void>(general(follow_up(0, 1s), 1s));
  static_cast<void>(
      receiver_.on_transmit_timestamp({MessageType::kDelayReq, id}, local(1s), local(1s)));
  for (std::uint16_t i = 1; i < 9; ++i) {
    static_cast<void>(event(sync_from(kA, i), 1s + i * 125ms));
    EXPECT_TRUE(of<EmitPair>(general(follow_up(i, 2s + i * 125ms), 1s + i * 125ms)).empty());
  }
  EXPECT_EQ(count(Counter::kDoubtedTime), 8U) << "for a second";
  static_cast<void>(event(sync_from(kA, 9), 2125ms));
  const auto actions = general(follow_up(9, 3125ms), 2125ms);
  ASSERT_EQ(of<ReferenceJumped>(actions).size(), 1U);
  EXPECT_EQ(of<ReferenceJumped>(actions)[0].jump, Duration{1s});
  ASSERT_EQ(of<EmitPair>(actions).size(), 1U) << "the pair tells the truth: the servo decides";
  EXPECT_TRUE(std::holds_alternative<ReferenceJumped>(actions[0])) << "the news comes first";
  EXPECT_EQ(count(Counter::kReferenceJumps), 1U);
  EXPECT_TRUE(of<EmitPair>(general(delay_resp(id, 3126ms), 2126ms)).empty());
  EXPECT_EQ(count(Counter::kStaleDelayResp), 1U);
  EXPECT_EQ(of<SendMessage>(receiver_.on_timer(local(2126ms))).size(), 1U) << "asked again at once";

  static_cast<void>(event(sync_from(kA, 10), 2250ms));
  EXPECT_TRUE(of<ReferenceJumped>(general(follow_up(10, 3250ms), 2250ms)).empty()) << "told once";
  for (std::uint16_t i = 11; i < 20; ++i) {
    static_cast<void>(event(sync_from(kA, i), 1s + i * 125ms));
    const auto back = of<ReferenceJumped>(general(follow_up(i, 1s + i * 125ms), 1s + i * 125ms));
    ASSERT_EQ(back.size(), i < 19 ? 0U : 1U);
    for (const ReferenceJumped& one : back) EXPECT_EQ(one.jump, Duration{-1s});
  }
}

// One pair an hour ahead, four times a second between eight true ones, ran the clock at its limit.
TEST_F(Receiver, syncs_that_contradict_the_others_one_by_one_or_in_a_burst_are_never_followed) {
  select_a();
  std::uint16_t id = 0;
  std::size_t emitted = 0;
  const auto hear = [&](Nanoseconds at, Nanoseconds told) {
    const auto actions = event(message_from(kA, id++, Sync{reference(told)}), at);
    EXPECT_TRUE(of<ReferenceJumped>(actions).empty());
    emitted += of<EmitPair>(actions).size();
  };
  for (int i = 0; i < 200; ++i) {
    const Nanoseconds at = 1s + i * 125ms;
    hear(at, at);
    if (i % 2 == 0) hear(at + 30ms, at + 1h);
    if (i % 20 == 10) {
      for (int n = 0; n < 4; ++n) hear(at + 40ms + n * 1ms, at + 2h);
    }
  }
  EXPECT_EQ(emitted, 200U);
  EXPECT_EQ(count(Counter::kReferenceJumps), 0U);
  EXPECT_EQ(count(Counter::kDoubtedTime), 100U + 40U);
}

// Each change of the sign began the contradiction anew, and after seconds of it the oscillator's
// doubt was as wide as the forgery.
TEST_F(Receiver, syncs_that_contradict_each_other_too_do_not_wear_the_oscillator_out) {
  select_a();
  std::uint16_t id = 0;
  std::size_t emitted = 0;
  const auto hear = [&](Nanoseconds at, Nanoseconds told) {
    const auto actions = event(message_from(kA, id++, Sync{reference(told)}), at);
    emitted += of<EmitPair>(actions).size();
  };
  for (int i = 0; i < 8; ++i) hear(1s + i * 125ms, 1s + i * 125ms);
  for (int i = 0; i < 600; ++i) {
    const Nanoseconds at = 2s + i * 100ms;
    hear(at, at + (i % 2 == 0 ? 999ms : -999ms));
    if (i % 20 == 0) static_cast<void>(general(announce_from(kA), at));
  }
  EXPECT_EQ(emitted, 8U);
  hear(63s, 63s);
  EXPECT_EQ(emitted, 9U);
}

// The silence was taken for the usual gap between two Syncs, and the true ones were doubted for as
// long.
TEST_F(Receiver, one_wrong_sync_after_a_silence_is_not_believed_longer_than_any_other) {
  select_a();
  std::uint16_t id = 0;
  const auto emitted = [&](Nanoseconds at, Nanoseconds told) {
    return of<EmitPair>(event(message_from(kA, id++, Sync{reference(told)}), at)).size();
  };
  EXPECT_EQ(emitted(1s, 1s), 1U);
  EXPECT_EQ(emitted(61s, 62s), 1U);
  EXPECT_EQ(emitted(62s, 62s), 0U);
  EXPECT_EQ(emitted(63s, 63s), 0U);
  EXPECT_EQ(emitted(64s, 64s), 1U);
}

// Syncs that tell the true time make the gap between two short; three an hour ahead within a few
// milliseconds were then a jump.
TEST_F(Receiver, a_burst_behind_forged_syncs_that_agree_is_no_jump_either) {
  select_a();
  std::uint16_t id = 0;
  const auto hear = [&](Nanoseconds at, Nanoseconds told) {
    return event(message_from(kA, id++, Sync{reference(told)}), at);
  };
  for (Nanoseconds at = 1s; at < 20s; at += 1s) {
    EXPECT_EQ(of<EmitPair>(hear(at, at)).size(), 1U);
    for (Nanoseconds after = 1ms; after < 500ms; after += 1ms) {
      static_cast<void>(hear(at + after, at + after));
    }
    for (Nanoseconds after = 500ms; after < 990ms; after += 10ms) {
      EXPECT_TRUE(of<EmitPair>(hear(at + after, at + after + 1h)).empty());
    }
  }
  EXPECT_EQ(count(Counter::kReferenceJumps), 0U);
}

// A forged Follow_Up that is there before the Sync took the true one's place: 431 us while locked.
TEST_F(Receiver, follow_ups_before_their_sync_count_until_one_is_contradicted) {
  select_a();
  std::size_t forged = 0;
  for (std::uint16_t i = 0; i < 40; ++i) {
    const Nanoseconds sent = 1s + i * 125ms;
    static_cast<void>(general(follow_up(i, sent + 300us), sent - 1ms));
    const auto early = of<EmitPair>(event(sync_from(kA, i), sent + kDelay));
    const auto late = of<EmitPair>(general(follow_up(i, sent), sent + 2 * kDelay));
    forged += early.size();
    EXPECT_EQ(late.size(), i == 0 ? 0U : 1U) << i;
  }
  EXPECT_EQ(forged, 1U) << "the first, before anybody could know";
  EXPECT_EQ(count(Counter::kContradictingFollowUp), 1U);
  EXPECT_EQ(count(Counter::kEarlyFollowUp), 39U);
}

TEST_F(Receiver, two_transmitters_of_one_identity_are_counted_as_such_and_copies_are_not) {
  select_a();
  for (std::uint16_t i = 0; i < 10; ++i) {
    const Nanoseconds sent = 1s + 125ms * i;
    static_cast<void>(exchange(i, sent));
    static_cast<void>(general(follow_up(i, sent), sent + 1ms));
  }
  EXPECT_EQ(count(Counter::kContradictingFollowUp), 0U);
  for (std::uint16_t i = 10; i < 20; ++i) {
    const Nanoseconds sent = 1s + 125ms * i;
    static_cast<void>(exchange(i, sent));
    static_cast<void>(general(follow_up(i, sent + 2ms), sent + 3ms));
  }
  EXPECT_EQ(count(Counter::kContradictingFollowUp), 10U);
}

TEST_F(Receiver, an_answer_an_hour_off_is_no_delay) {
  select_a();
  const auto id = of<SendMessage>(event(sync_from(kA, 0), 1s))[0].sequence_id;
  static_cast<void>(general(follow_up(0, 1s), 1s));
  static_cast<void>(
      receiver_.on_transmit_timestamp({MessageType::kDelayReq, id}, local(1s), local(1s)));
  EXPECT_TRUE(of<EmitPair>(general(delay_resp(id, 1s + 1h), 1s + 1ms)).empty());
  EXPECT_EQ(count(Counter::kDoubtedTime), 1U);
}

TEST_F(Receiver, a_transmitter_started_again_with_the_same_ids_makes_no_wrong_pair) {
  select_a();
  static_cast<void>(event(sync_from(kA, 0), 1s));          // then it died, before the Follow_Up
  static_cast<void>(event(sync_from(kA, 0), 1s + 400ms));  // and began again with the same id
  EXPECT_TRUE(of<EmitPair>(general(follow_up(0, 1s + 400ms), 1s + 401ms)).empty());
  EXPECT_EQ(count(Counter::kDuplicateSync), 1U);
  EXPECT_EQ(of<EmitPair>(exchange(1, 1s + 525ms)).size(), 1U);
}

}  // namespace
}  // namespace ftcs::ptp::receiver_test
