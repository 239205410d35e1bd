// SPDX-License-Identifier: MIT
// World: message streams that repeat, overtake, jump back or change their rate.
#include <gtest/gtest.h>

#include "ftcs/estimation/interval_meter.h"
#include "ftcs/estimation/message_order.h"

namespace ftcs::estimation {
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

TEST(IntervalMeter, measures_the_first_interval_if_none_is_configured) {
  IntervalMeter meter;
  EXPECT_EQ(meter.observe(pair_at(0, 0)), 1.0);
  EXPECT_DOUBLE_EQ(meter.observe(pair_at(125'000'000, 0)), 0.125);
  EXPECT_DOUBLE_EQ(meter.interval_ns(), 125e6);
}

TEST(IntervalMeter, keeps_its_interval_over_gaps_and_adopts_a_lasting_change) {
  IntervalMeter meter{1e9};
  std::int64_t now = 0;
  (void)meter.observe(pair_at(now, 0));
  for (int i = 0; i < 9; ++i) {
    now += i % 3 == 0 ? 10'000'000'000 : 1'000'000'000;
    EXPECT_EQ(meter.observe(pair_at(now, 0)), 1.0);
  }
  double factor = 1.0;
  for (int i = 0; i < 4; ++i) {
    now += 62'500'000;
    factor *= meter.observe(pair_at(now, 0));
  }
  EXPECT_DOUBLE_EQ(factor, 0.0625);
  EXPECT_DOUBLE_EQ(meter.interval_ns(), 62.5e6);
}

}  // namespace
}  // namespace ftcs::estimation
