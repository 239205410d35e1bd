// SPDX-License-Identifier: MIT
// World: message streams that repeat, overtake or jump back.
#include "ftcs/measurement/message_order.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

using Verdict = MessageOrder::Verdict;

TimestampPair pair_at(std::int64_t reference_ns, std::int64_t free_ns) {
  TimestampPair pair;
  pair.reference = ReferenceTime::from_ns(reference_ns);
  pair.free_running = FreeRunningTime::from_ns(free_ns);
  return pair;
}

TEST(MessageOrder, refuses_repetitions_for_ever) {
  MessageOrder order;
  EXPECT_EQ(order.judge(pair_at(100, 100)), Verdict::kNews);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(order.judge(pair_at(100, 100)), Verdict::kDuplicate);
  EXPECT_EQ(order.judge(pair_at(200, 200)), Verdict::kNews);
}

TEST(MessageOrder, refuses_a_message_that_was_overtaken) {
  MessageOrder order;
  (void)order.judge(pair_at(100, 100));
  (void)order.judge(pair_at(300, 300));
  EXPECT_EQ(order.judge(pair_at(200, 200)), Verdict::kDuplicate);
  EXPECT_EQ(order.judge(pair_at(400, 400)), Verdict::kNews);
}

TEST(MessageOrder, accepts_that_a_clock_was_set_back) {
  MessageOrder order;
  (void)order.judge(pair_at(10'000, 10'000));
  EXPECT_EQ(order.judge(pair_at(100, 11'000)), Verdict::kImplausible);
  EXPECT_EQ(order.judge(pair_at(1'100, 12'000)), Verdict::kImplausible);
  EXPECT_EQ(order.judge(pair_at(2'100, 13'000)), Verdict::kNewEpoch);
  EXPECT_EQ(order.judge(pair_at(3'100, 14'000)), Verdict::kNews);
}

TEST(MessageOrder, one_absurd_stamp_does_not_block_what_follows) {
  MessageOrder order;
  (void)order.judge(pair_at(1'000, 1'000));
  (void)order.judge(pair_at(1LL << 62, 1LL << 62));
  (void)order.judge(pair_at(-(1LL << 62), 1LL << 61));
  int refused = 0;
  for (int i = 0; i < 10; ++i) {
    const Verdict verdict = order.judge(pair_at(2'000 + i, 2'000 + i));
    if (verdict != Verdict::kNews) ++refused;
  }
  EXPECT_LE(refused, 3);
}

TEST(MessageOrder, directions_are_independent) {
  MessageOrder order;
  (void)order.judge(pair_at(1'000, 1'000));
  TimestampPair back = pair_at(500, 500);
  back.direction = Direction::kBackward;
  EXPECT_EQ(order.judge(back), Verdict::kNews);
}

}  // namespace
}  // namespace ftcs
