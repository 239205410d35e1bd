// SPDX-License-Identifier: MIT
// World: message streams that change their rate.
#include <gtest/gtest.h>

#include "ftcs/estimation/interval_meter.h"

namespace ftcs::estimation {
namespace {

TimestampPair pair_at(std::int64_t reference_ns, std::int64_t free_ns) {
  TimestampPair pair;
  pair.reference = ReferenceTime::from_ns(reference_ns);
  pair.free_running = FreeRunningTime::from_ns(free_ns);
  return pair;
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
