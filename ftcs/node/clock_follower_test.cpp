// SPDX-License-Identifier: MIT
//
// World: an exact reference, eight Syncs a second over a link of 10 us, a clock that can refuse.
// What is decided is shown here, by notes; what is logged of it, beside the log.
#include "ftcs/node/clock_follower.h"

#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/manual_source.h"
#include "test/support/watched_clock.h"

namespace ftcs::node {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kLink = 10'000;

class Decisions : public testing::Test {
 protected:
  void begin(Duration offset = {}) {
    clock.emplace(source, offset);
    follower.emplace(config, *clock);
  }
  void take() {
    while (const auto event = follower->next()) {
      if (const auto* note = std::get_if<Note>(&*event)) notes.push_back(*note);
      if (const auto* steered = std::get_if<Steered>(&*event)) samples.push_back(*steered);
    }
  }
  void sync(std::int64_t link = kLink, std::int64_t late = 0) {
    at += kSecond / 8;
    source.instant = FreeRunningTime::from_ns(at + link + late);
    follower->on_pair({Direction::kForward, ReferenceTime::from_ns(at), source.instant},
                      std::nullopt);
    take();
  }
  void request() {
    const std::int64_t sent = at + 3 * kLink;
    source.instant = FreeRunningTime::from_ns(sent);
    follower->on_pair({Direction::kBackward, ReferenceTime::from_ns(sent + kLink), source.instant},
                      std::nullopt);
    take();
  }
  void silence(std::int64_t ns) {
    source.instant = FreeRunningTime::from_ns(at + ns);
    follower->on_silence();
    take();
  }
  /// 20 ms before the next Sync; the neighbour's stamps are `ahead` of its Syncs.
  void exchange(std::int64_t link, std::int64_t ahead, bool first = false) {
    const std::int64_t asked = at + kSecond / 8 - 20'000'000;
    const std::int64_t answered = asked + 5'000'000;
    source.instant = FreeRunningTime::from_ns(answered + link);
    follower->on_link_delay(
        {Duration::from_whole_ns(link),
         {},
         first,
         ptp::PeerStamps{
             {Direction::kBackward, ReferenceTime::from_ns(asked + link + ahead),
              FreeRunningTime::from_ns(asked)},
             {Direction::kForward, ReferenceTime::from_ns(answered + ahead), source.instant}}},
        std::nullopt);
    take();
  }
  void unstamped_exchange(std::int64_t link) {
    follower->on_link_delay({Duration::from_whole_ns(link), {}, false, {}}, std::nullopt);
    take();
  }
  void peer_cycles(int count, std::int64_t ahead = 0) {
    for (int i = 0; i < count; ++i) {
      exchange(kLink, ahead);
      sync();
    }
  }
  [[nodiscard]] std::vector<NoteKind> kinds() const {
    std::vector<NoteKind> result;
    for (const Note& note : notes) result.push_back(note.kind);
    return result;
  }

  test::ManualSource source;
  ClockFollowerConfig config;
  std::optional<test::WatchedClock> clock;
  std::optional<ClockFollower> follower;
  std::vector<Note> notes;
  std::vector<Steered> samples;
  std::int64_t at = 0;
};

TEST_F(Decisions, each_message_is_told_with_what_the_clock_showed_before_it_was_steered) {
  begin(Nanoseconds{1'000});
  for (int i = 0; i < 4; ++i) {
    sync();
    request();
  }
  ASSERT_EQ(samples.size(), 8U);
  EXPECT_TRUE(notes.empty());
  const Steered& steering = samples[2];
  EXPECT_TRUE(steering.telemetry.commanded);
  EXPECT_NEAR(steering.perceived.ns(), 1'000.0, 1.0) << "the path delay taken off";
  EXPECT_NEAR(steering.telemetry.servo.path_delay.ns(), kLink, 1.0);
  EXPECT_EQ(steering.local, LocalTime::from_ns(kSecond / 4 + kLink + 1'000));
  EXPECT_EQ(samples.back().telemetry.direction, Direction::kBackward);
}

TEST_F(Decisions, silence_is_told_once_and_with_the_syncs_that_came_in_vain) {
  begin();
  for (int i = 0; i < 40; ++i) {
    sync();
    request();
  }
  silence(kSecond);
  silence(kSecond + 1);
  ASSERT_EQ(kinds(), std::vector{NoteKind::kHoldover});
  EXPECT_EQ(notes[0].refused_syncs, 0U);
  for (int i = 0; i < 40; ++i) {
    sync();
    request();
  }
  notes.clear();
  for (int i = 0; i < 5; ++i) {
    sync(kLink, 1'000'000);
    silence(kLink + 1'000'000);
  }
  ASSERT_EQ(kinds(), std::vector{NoteKind::kHoldover});
  EXPECT_EQ(notes[0].refused_syncs, 4U);
}

TEST_F(Decisions, a_first_offset_beyond_its_bound_is_told_with_each_message_and_not_steered) {
  config.discipline.largest_offset = Nanoseconds{kSecond};
  begin(Duration::from_whole_ns(37 * kSecond));
  for (int i = 0; i < 4; ++i) {
    sync();
    request();
  }
  ASSERT_FALSE(notes.empty());
  EXPECT_EQ(notes[0].kind, NoteKind::kOffsetRefused);
  EXPECT_NEAR(notes[0].offset.seconds(), 37.0, 1e-3);
  EXPECT_EQ(follower->discipline().counters().commands, 0U);
}

TEST_F(Decisions, a_path_longer_than_its_limit_steers_nothing_and_is_told_seldom) {
  config.largest_path_delay = Nanoseconds{100'000};
  begin();
  for (int i = 0; i < 20; ++i) {
    sync();
    request();
  }
  const std::uint64_t used = follower->discipline().counters().used;
  EXPECT_EQ(used, 20U);
  notes.clear();
  for (int i = 0; i < 16; ++i) {
    sync(kLink, 300'000);
    request();
  }
  EXPECT_EQ(follower->discipline().counters().used, used);
  ASSERT_EQ(kinds(), std::vector(6, NoteKind::kPathDelayRefused)) << "1, 2, 4, 8, 16 and 32";
  EXPECT_NEAR(notes[1].path_delay.ns(), 150'000.0 + kLink, 10.0);
  for (int i = 0; i < 4; ++i) {
    sync();
    request();
  }
  EXPECT_EQ(follower->discipline().counters().used, used + 4U) << "back at once";
}

TEST_F(Decisions, a_clock_at_its_limit_is_told_with_what_is_left) {
  config.discipline.servo.kind = ServoKind::kFtcs;
  config.discipline.servo.limits = RateLimits::symmetric_ppb(500e3);
  begin(Duration::from_whole_ns(kSecond / 2));
  for (int i = 0; i < 20; ++i) {
    sync();
    request();
  }
  ASSERT_EQ(kinds(), (std::vector{NoteKind::kSaturated, NoteKind::kSaturated}));
  EXPECT_EQ(notes[1].times, 16U);
  EXPECT_NEAR(notes[0].offset.seconds(), 0.5, 0.01);
}

TEST_F(Decisions, a_clock_that_refuses_is_told_once_for_a_series) {
  begin();
  clock->refuse = true;
  for (int i = 0; i < 10; ++i) {
    sync();
    request();
  }
  ASSERT_EQ(kinds(), std::vector{NoteKind::kClockRefused});
  EXPECT_EQ(notes[0].error, ClockError::kBusy);
  clock->refuse = false;
  sync();
  clock->refuse = true;
  sync();
  EXPECT_EQ(notes.size(), 2U);
}

class PeerDecisions : public Decisions {
 protected:
  PeerDecisions() {
    config.peer_to_peer = true;
    config.discipline.servo.kind = ServoKind::kAdaptive;
  }
};

TEST_F(PeerDecisions, nothing_is_steered_before_the_link_delay_and_then_the_newest_first) {
  begin();
  for (int i = 0; i < 3; ++i) sync();
  EXPECT_TRUE(samples.empty());
  unstamped_exchange(kLink);
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].event, source.instant);
  EXPECT_NEAR(samples[0].telemetry.servo.path_delay.ns(), kLink, 1e-6) << "the link's";
}

TEST_F(PeerDecisions, shared_stamps_are_heard_beside_the_syncs) {
  begin();
  peer_cycles(30);
  EXPECT_EQ(kinds(), std::vector{NoteKind::kStampsShared});
  int beside = 0;
  for (const Steered& sample : samples) beside += sample.paces ? 0 : 1;
  EXPECT_EQ(beside, 2 * 25);
}

TEST_F(PeerDecisions, stamps_that_depart_are_told_by_how_much_and_the_start_is_a_new_one) {
  begin();
  peer_cycles(100);
  peer_cycles(100, 500);
  EXPECT_EQ(kinds(), (std::vector{NoteKind::kStampsShared, NoteKind::kStampsDeparted}));
  EXPECT_NEAR(notes[1].difference_ns, 500.0, 1.0);
  EXPECT_EQ(follower->discipline().counters().new_references, 1U);
}

TEST_F(Decisions, a_jump_of_the_reference_is_told_with_what_becomes_of_it) {
  config.discipline.largest_offset = std::chrono::seconds{1};
  begin();
  for (int i = 0; i < 20; ++i) {
    sync();
    request();
  }
  follower->on_reference_jump(Duration::from_whole_ns(-kSecond / 2));
  follower->on_reference_jump(Duration::from_whole_ns(2 * kSecond));
  take();
  EXPECT_EQ(kinds(), (std::vector{NoteKind::kReferenceJumped, NoteKind::kReferenceJumped}));
  EXPECT_EQ(notes[0].plan.response, JumpResponse::kSlewed);
  EXPECT_GT(notes[0].plan.slew, Duration{});
  EXPECT_EQ(notes[1].plan.response, JumpResponse::kRefused);
  EXPECT_EQ(follower->discipline().counters().new_references, 2U);
}

TEST_F(PeerDecisions, stamps_that_never_agreed_are_told_without_a_new_start) {
  begin();
  peer_cycles(100, 37 * kSecond);
  ASSERT_EQ(kinds(), std::vector{NoteKind::kStampsForeign});
  EXPECT_NEAR(notes[0].difference_ns, 37e9, 1.0);
  EXPECT_EQ(follower->discipline().counters().new_references, 0U);
}

TEST_F(PeerDecisions, a_neighbour_that_is_not_the_transmitter_any_more_is_told) {
  begin();
  peer_cycles(50);
  for (int i = 0; i < 20; ++i) {
    unstamped_exchange(kLink);
    sync();
  }
  EXPECT_EQ(kinds(), (std::vector{NoteKind::kStampsShared, NoteKind::kNeighbourIsAnother}));
}

TEST_F(PeerDecisions, a_first_exchange_that_contradicts_the_path_is_another_link) {
  begin();
  peer_cycles(50);
  follower->on_new_link();
  exchange(3 * kLink, 0, true);
  EXPECT_EQ(kinds(), (std::vector{NoteKind::kStampsShared, NoteKind::kAnotherLink}));
}

TEST_F(PeerDecisions, an_exchange_of_which_everything_comes_at_once_loses_no_event) {
  begin();
  peer_cycles(50);
  clock->refuse = true;
  follower->on_new_link();
  sync(3 * kLink);  // waits
  samples.clear();
  exchange(3 * kLink, 0, true);
  EXPECT_EQ(notes[1].kind, NoteKind::kAnotherLink);
  ASSERT_EQ(samples.size(), 1U) << "the waiting one; the comparison begins anew";
  EXPECT_EQ(samples[0].telemetry.verdict, SampleVerdict::kUsed);
}

TEST_F(PeerDecisions, takes_no_memory_but_its_own) {
  begin();
  notes.reserve(100);
  samples.reserve(1'000);
  const test::ForbidAllocation none;
  peer_cycles(100, 0);
  follower->on_new_reference();
  peer_cycles(20, 500);
  silence(kSecond);
}

}  // namespace
}  // namespace ftcs::node
