// SPDX-License-Identifier: MIT
#include "ftcs/daemon/phc/reading_messages.h"

#include <vector>

#include <gtest/gtest.h>

namespace ftcs::daemon {
namespace {

struct Told {
  Direction direction;
  std::int64_t source_ns;
  bool operator==(const Told&) const = default;
};

class ReadingMessagesTest : public testing::Test {
 protected:
  std::vector<Told> tell(std::int64_t width_ns, bool may_split = true) {
    std::vector<Told> told;
    for (const auto& message : messages_.of({kSourceNs, 0, width_ns}, may_split)) {
      told.push_back({message.direction, message.source.since_epoch().floor_ns()});
    }
    return told;
  }
  void grow_up() {
    for (int i = 0; i < kYoung; ++i) tell(1000);
  }
  static std::vector<Told> twice(std::int64_t apart_ns) {
    return {{Direction::kBackward, kSourceNs + apart_ns / 2},
            {Direction::kForward, kSourceNs - apart_ns / 2}};
  }

  static constexpr std::int64_t kSourceNs = 1'000'000'000;
  static constexpr int kYoung = 16;
  const std::vector<Told> once_{{Direction::kForward, kSourceNs}};
  ReadingMessages messages_;
};

TEST_F(ReadingMessagesTest, the_first_readings_are_told_in_both_directions) {
  for (int i = 0; i < kYoung; ++i) EXPECT_EQ(tell(1000), twice(0)) << i;
  EXPECT_EQ(tell(1000), once_);
}

TEST_F(ReadingMessagesTest, a_clock_that_is_latched_together_with_the_other_is_told_once) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(tell(0), once_);
}

TEST_F(ReadingMessagesTest, a_reading_about_as_wide_as_usual_is_its_middle_once) {
  grow_up();
  for (int i = 0; i < 40; ++i) EXPECT_EQ(tell(1000 + i), once_);
}

// One in eight, as after the end of each second of a clock that is read eight times in it.
TEST_F(ReadingMessagesTest, one_that_is_a_little_wider_than_the_others_are_is_not_told) {
  grow_up();
  for (int i = 0; i < 80; ++i) {
    EXPECT_EQ(tell(i % 8 == 7 ? 1040 : 1000), i % 8 == 7 ? std::vector<Told>{} : once_) << i;
  }
  EXPECT_EQ(tell(1040, false), once_) << "to a servo that takes every middle it is";
}

TEST_F(ReadingMessagesTest, where_readings_differ_all_along_they_are_told) {
  grow_up();
  for (int i = 0; i < 40; ++i) tell(1000 + 13 * (i % 5));
  EXPECT_EQ(tell(1052), once_);
}

TEST_F(ReadingMessagesTest, what_a_reading_took_longer_is_half_a_delay_in_either_direction) {
  grow_up();
  EXPECT_EQ(tell(3000), twice(2000));
  EXPECT_EQ(tell(1000), once_);
}

TEST_F(ReadingMessagesTest, a_quicker_one_than_usual_is_no_early_message) {
  grow_up();
  EXPECT_EQ(tell(400), once_);
}

TEST_F(ReadingMessagesTest, readings_that_have_become_slow_are_usual_after_some) {
  grow_up();
  int split = 0;
  for (int i = 0; i < 15; ++i) split += tell(2000).size() == 2 ? 1 : 0;
  EXPECT_EQ(split, 7);
}

TEST_F(ReadingMessagesTest, a_servo_that_does_not_weigh_lateness_gets_the_middle) {
  EXPECT_EQ(tell(1000, false), once_);
  grow_up();
  EXPECT_EQ(tell(3000, false), once_);
}

}  // namespace
}  // namespace ftcs::daemon
