// SPDX-License-Identifier: MIT
// Senders that ask a limit of 64 places, in simulated time.
#include "ftcs/ptp/answer_limit.h"

#include <gtest/gtest.h>

namespace ftcs::ptp {
namespace {

using namespace std::chrono_literals;
constexpr std::size_t kPlaces = 64;

PortIdentity sender(unsigned n) {
  PortIdentity identity;
  for (std::size_t i = 0; i < 4; ++i) {
    identity.clock.octets[i] = static_cast<std::uint8_t>(n >> (8 * i));
  }
  identity.port = 1;
  return identity;
}

class AnswerLimitTest : public testing::Test {
 protected:
  /// Answers to one that asks every `interval` for `time`.
  int asks(unsigned who, Nanoseconds interval, Nanoseconds time) {
    int answers = 0;
    for (Nanoseconds t{0}; t < time; t += interval) {
      answers += limit_.admits(sender(who), now_) ? 1 : 0;
      now_ = now_ + Duration{interval};
    }
    return answers;
  }

  AnswerLimit<kPlaces> limit_;
  FreeRunningTime now_ = FreeRunningTime::from_ns(1'000'000'000'000);
};

TEST_F(AnswerLimitTest, who_asks_at_the_shortest_interval_is_answered_each_time) {
  EXPECT_EQ(asks(1, 7812500ns, 60s), 60 * 128);
}

TEST_F(AnswerLimitTest, random_intervals_and_bursts_of_that_mean_pass_too) {
  for (int i = 0; i < 60; ++i) {
    EXPECT_EQ(asks(1, 10us, 1280us), 128);  // a second's requests at once
    now_ = now_ + Duration{998'720us};
  }
}

TEST_F(AnswerLimitTest, a_flood_of_one_sender_is_answered_256_times_a_second) {
  asks(1, 100us, 2s);
  EXPECT_EQ(asks(1, 100us, 10s), 2560);
}

TEST_F(AnswerLimitTest, invented_senders_take_nothing_from_those_who_were_there) {
  int answers = 0;
  int flood = 0;
  unsigned invented = 1000;
  for (int second = 0; second < 30; ++second) {
    for (unsigned who = 0; who < 20; ++who) answers += limit_.admits(sender(who), now_) ? 1 : 0;
    if (second == 0) answers = 0;
    for (int i = 0; i < 10'000; ++i) {
      flood += limit_.admits(sender(invented++), now_) ? 1 : 0;
      now_ = now_ + Duration{100us};
    }
  }
  EXPECT_EQ(answers, 29 * 20);
  EXPECT_LE(flood, 31 * 1024 + 44 * 4);
}

TEST_F(AnswerLimitTest, floods_under_all_names_leave_each_his_share) {
  // 63 flood, one asks eight times a second.
  int answers = 0;
  int flood = 0;
  for (int i = 0; i < 10 * 8; ++i) {
    answers += limit_.admits(sender(0), now_) ? 1 : 0;
    for (unsigned n = 0; n < 63 * 25; ++n) flood += limit_.admits(sender(1 + n % 63), now_) ? 1 : 0;
    now_ = now_ + Duration{125ms};
  }
  EXPECT_EQ(answers, 10 * 8);
  EXPECT_LE(flood, 11 * 4096);
}

TEST_F(AnswerLimitTest, a_newcomer_gets_the_place_of_one_who_left) {
  for (unsigned who = 0; who < kPlaces; ++who) EXPECT_TRUE(limit_.admits(sender(who), now_));
  now_ = now_ + Duration{11s};
  asks(500, 100us, 1s);  // were he a stranger, it would be 1,024 a second
  EXPECT_EQ(asks(500, 100us, 1s), 256);
}

TEST_F(AnswerLimitTest, a_clock_that_is_set_back_shuts_nobody_out) {
  asks(1, 100us, 2s);
  now_ = now_ - Duration{3600s};
  EXPECT_TRUE(limit_.admits(sender(1), now_));
  for (unsigned who = 2; who < 200; ++who) EXPECT_TRUE(limit_.admits(sender(who), now_));
}

}  // namespace
}  // namespace ftcs::ptp
