// SPDX-License-Identifier: MIT
// World: a machine on 2024-01-02, later on the last day of 2023; announcements once a second.
#include "ftcs/node/utc_follower.h"

#include <vector>

#include <gtest/gtest.h>

namespace ftcs::node {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kNewYear2024 = 1'704'067'200;
constexpr std::int64_t kDay = 86'400;

class UtcFollowerTest : public testing::Test {
 protected:
  UtcMoment moment() { return {FreeRunningTime::from_ns(at_s * kSecond), start_s + at_s, listed}; }
  void announce(const ReferenceScale& scale, int times = 1) {
    for (int i = 0; i < times; ++i) {
      ++at_s;
      utc.on_announced(scale, moment());
      utc.on_time(moment());
    }
  }
  bool read(std::int64_t ahead_of_system_s = 0) {
    const std::int64_t reference = start_s + at_s + utc.utc_offset() + ahead_of_system_s;
    return utc.admits(ReferenceTime::from_ns(reference * kSecond), false,
                      {(start_s + at_s) * kSecond, moment().machine}, moment().machine);
  }
  std::vector<UtcNoteKind> notes() {
    std::vector<UtcNoteKind> kinds;
    while (const auto note = utc.next_note()) kinds.push_back(note->kind);
    return kinds;
  }
  using Kinds = std::vector<UtcNoteKind>;

  std::int64_t start_s = kNewYear2024 + kDay;
  std::int64_t at_s = 0;
  std::optional<ListedUtc> listed{};
  UtcFollower utc{{.utc_offset = 37, .epoch = {.earliest_utc_s = kNewYear2024 - kDay}}};
};

TEST_F(UtcFollowerTest, the_expected_offset_is_believed_at_once) {
  EXPECT_FALSE(read()) << "no word about the timescale yet";
  EXPECT_FALSE(utc.refusal().has_value());
  announce({.utc_offset = 37});
  EXPECT_TRUE(read());
  EXPECT_EQ(utc.utc_offset(), 37);
  EXPECT_EQ(notes(), Kinds{UtcNoteKind::kOffsetFound});
}

TEST_F(UtcFollowerTest, one_announcement_changes_nothing) {
  announce({.utc_offset = 37});
  (void)notes();
  for (const int forged : {-32'768, 0, 36, 38, 60, 61, 32'767}) {
    announce({.utc_offset = forged});
    EXPECT_EQ(utc.utc_offset(), 37) << forged;
    announce({.utc_offset = 37}, 2);
  }
  announce({.tai = false});
  EXPECT_TRUE(utc.is_tai());
  EXPECT_EQ(utc.utc_offset(), 37);
  EXPECT_EQ(notes(), (Kinds{UtcNoteKind::kOffsetDoubted, UtcNoteKind::kOffsetUnconfirmed,
                            UtcNoteKind::kTimescaleDoubted}))
      << "each kind once a minute";
}

TEST_F(UtcFollowerTest, an_offset_a_second_away_is_believed_when_it_lasts) {
  announce({.utc_offset = 37});
  announce({.utc_offset = 38}, 10);
  EXPECT_EQ(utc.utc_offset(), 37);
  announce({.utc_offset = 38});
  EXPECT_EQ(utc.utc_offset(), 38);
  EXPECT_EQ(notes().back(), UtcNoteKind::kOffsetChanged);
}

TEST_F(UtcFollowerTest, few_announcements_do_not_suffice_however_long_they_last) {
  announce({.utc_offset = 37});
  for (int i = 0; i < UtcFollower::kAnnouncements; ++i) {
    EXPECT_EQ(utc.utc_offset(), 37) << i;
    at_s += 30;
    announce({.utc_offset = 36});
  }
  EXPECT_EQ(utc.utc_offset(), 36);
}

TEST_F(UtcFollowerTest, who_is_contradicted_is_never_believed) {
  announce({.utc_offset = 37});
  for (int i = 0; i < 100; ++i) {
    announce({.utc_offset = 38}, 9);
    announce({.utc_offset = 37});
  }
  EXPECT_EQ(utc.utc_offset(), 37);
}

TEST_F(UtcFollowerTest, an_offset_far_from_the_list_is_never_believed) {
  listed = ListedUtc{40};
  announce({.utc_offset = 37}, 100);
  EXPECT_EQ(utc.utc_offset(), 40);
  announce({.utc_offset = 39}, 20);
  EXPECT_EQ(utc.utc_offset(), 39);
}

TEST_F(UtcFollowerTest, a_first_offset_a_second_away_is_waited_for) {
  announce({.utc_offset = 38}, 5);
  EXPECT_FALSE(read());
  EXPECT_EQ(utc.refusal(), UtcRefusal::kOffsetUnconfirmed);
  announce({.utc_offset = 38}, 6);
  EXPECT_TRUE(read());
  EXPECT_EQ(utc.utc_offset(), 38);
  EXPECT_FALSE(utc.refusal().has_value());
}

TEST_F(UtcFollowerTest, an_offset_that_nobody_vouches_for_comes_from_the_list_or_the_rules) {
  announce({});
  EXPECT_EQ(utc.utc_offset(), 37);
  EXPECT_EQ(notes(), (Kinds{UtcNoteKind::kOffsetFound, UtcNoteKind::kOffsetNotVouchedFor}));
  listed = ListedUtc{39};
  announce({});
  EXPECT_EQ(utc.utc_offset(), 39) << "a list needs no confirmation";
  EXPECT_TRUE(notes().back() == UtcNoteKind::kOffsetChanged);
}

TEST_F(UtcFollowerTest, an_arbitrary_timescale_is_not_followed_and_given_up_after_a_while) {
  announce({.tai = false, .utc_offset = 37});
  EXPECT_FALSE(read());
  EXPECT_EQ(utc.refusal(), UtcRefusal::kArbitraryTimescale);
  EXPECT_EQ(notes(), Kinds{UtcNoteKind::kRefused});
  at_s += 100;
  EXPECT_FALSE(utc.is_hopeless()) << "one message is no reason to give up";
  announce({.tai = false}, 1);
  EXPECT_TRUE(utc.is_hopeless());
  announce({.utc_offset = 37});
  EXPECT_TRUE(read());
  EXPECT_FALSE(utc.is_hopeless());
}

TEST_F(UtcFollowerTest, an_arbitrary_timescale_that_was_asked_for_is_taken_as_it_stands) {
  UtcRules rules;
  rules.epoch.any_epoch = true;
  utc = UtcFollower(rules);
  announce({.tai = false, .utc_offset = 37});
  EXPECT_TRUE(utc.known());
  EXPECT_FALSE(utc.is_tai());
  EXPECT_EQ(utc.utc_offset(), 0);
  EXPECT_TRUE(read(-start_s)) << "1970";
}

TEST_F(UtcFollowerTest, a_wrong_date_is_refused_and_given_up_after_a_while) {
  for (const std::int64_t wrong : {-kNewYear2024, kDay + 1}) {
    utc = UtcFollower({.epoch = {.earliest_utc_s = kNewYear2024 - kDay}});
    announce({.utc_offset = 37});
    for (int i = 0; i < 10; ++i) {
      EXPECT_FALSE(read(wrong));
      ++at_s;
    }
    EXPECT_FALSE(utc.is_hopeless());
    EXPECT_FALSE(read(wrong));
    EXPECT_TRUE(utc.is_hopeless());
    EXPECT_EQ(utc.refusal(), wrong < 0 ? UtcRefusal::kTooEarly : UtcRefusal::kFarFromSystem);
  }
}

TEST_F(UtcFollowerTest, a_jump_in_mid_run_is_not_followed_and_ends_nothing) {
  announce({.utc_offset = 37});
  EXPECT_TRUE(read());
  (void)notes();
  for (int i = 0; i < 50; ++i) {
    at_s += 1;
    EXPECT_FALSE(read(3'600));
    EXPECT_FALSE(utc.is_hopeless());
  }
  EXPECT_TRUE(read());
  EXPECT_EQ(notes(), (Kinds{UtcNoteKind::kJumped, UtcNoteKind::kFollowedAgain}));
}

TEST_F(UtcFollowerTest, a_leap_second_is_expected_once_it_is_announced_persistently) {
  start_s = kNewYear2024 - 40;
  announce({.utc_offset = 37});
  announce({.utc_offset = 37, .leap = 1});
  announce({.utc_offset = 37}, 2);
  EXPECT_EQ(utc.expected_leap(), 0) << "one forged bit inserts nothing";
  announce({.utc_offset = 37, .leap = 1}, 12);
  EXPECT_EQ(utc.expected_leap(), 1);
  EXPECT_EQ(utc.leap_due_s(), kNewYear2024);
  announce({.utc_offset = 37});
  EXPECT_EQ(utc.expected_leap(), 1) << "nor does one take it back";
  utc.on_leap_done(1);
  EXPECT_EQ(utc.utc_offset(), 38);
  EXPECT_EQ(utc.expected_leap(), 0);
}

TEST_F(UtcFollowerTest, a_leap_second_that_a_current_list_does_not_hold_is_not_believed) {
  for (const bool current : {true, false}) {
    utc = UtcFollower({});
    start_s = kNewYear2024 - 40;
    at_s = 0;
    listed = ListedUtc{.utc_offset = 37, .leap = 0, .current = current};
    announce({.utc_offset = 37, .leap = 1}, 20);
    EXPECT_EQ(utc.expected_leap(), current ? 0 : 1);
  }
}

TEST_F(UtcFollowerTest, a_leap_second_of_the_list_needs_no_announcement) {
  start_s = kNewYear2024 - 40;
  listed = ListedUtc{.utc_offset = 37, .leap = -1, .current = true};
  announce({.utc_offset = 37});
  EXPECT_EQ(utc.expected_leap(), -1);
}

TEST_F(UtcFollowerTest, what_the_user_fixed_is_not_announced_away) {
  utc.set_fixed(-5);
  announce({.tai = false, .utc_offset = 37, .leap = 1}, 20);
  EXPECT_EQ(utc.utc_offset(), -5);
  EXPECT_TRUE(read());
  EXPECT_FALSE(utc.refusal().has_value());
}

TEST(LastDayOfMonth, knows_months_and_leap_years) {
  constexpr std::int64_t kNewYear2017 = 1'483'228'800;
  EXPECT_TRUE(is_last_day_of_month(kNewYear2017 - 1));
  EXPECT_FALSE(is_last_day_of_month(kNewYear2017));
  EXPECT_TRUE(is_last_day_of_month(951'782'400));   // 29 February 2000
  EXPECT_FALSE(is_last_day_of_month(951'695'999));  // the end of 27 February 2000
}

}  // namespace
}  // namespace ftcs::node
