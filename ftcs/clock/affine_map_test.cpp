// SPDX-License-Identifier: MIT
#include "ftcs/clock/affine_map.h"

#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

// The world: clock i as a function of clock j. Oracle: the same product in long double (64 bits of
// mantissa), or, where every bit counts, in 128-bit integers.
using Map = AffineMap<FreeRunningTime, LocalTime>;
__extension__ using Wide = __int128;

// In units of 2^-32 ns.
Wide units(Duration duration) {
  return (static_cast<Wide>(duration.floor_ns()) << 32) + duration.fraction();
}

TEST(FixedRate, holds_every_double_between_a_half_and_two_exactly) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> ratios(0.5, 2.0);
  for (int i = 0; i < 10'000; ++i) {
    const Rate rate = Rate::from_ratio(ratios(random));
    ASSERT_EQ(FixedRate{rate}.rate(), rate);
  }
  EXPECT_EQ(FixedRate{}.rate(), Rate{});
  EXPECT_EQ(FixedRate{Rate::from_ratio(1.0 / 3.0)}.scaled(), 3002399751580330U);  // floor(2^53 / 3)
}

TEST(FixedRate, never_holds_a_rate_that_is_no_rate) {
  EXPECT_EQ(FixedRate{Rate::from_ratio(std::numeric_limits<double>::quiet_NaN())}.rate(), Rate{});
  EXPECT_EQ(FixedRate{Rate::from_ratio(std::numeric_limits<double>::infinity())}.rate().ratio(),
            1023.0);
  EXPECT_EQ(FixedRate{Rate::from_ratio(-1.0)}.rate().ratio(), 1.0 / 1024.0);
  EXPECT_EQ(FixedRate{Rate::from_ratio(0.0)}.rate().ratio(), 1.0 / 1024.0);
}

TEST(AffineMap, translates_as_equation_8) {
  const Map map{FreeRunningTime::from_ns(1'000), LocalTime::from_ns(50'000),
                Rate::from_ratio(1.25)};
  EXPECT_EQ(map(FreeRunningTime::from_ns(1'000)), LocalTime::from_ns(50'000));
  EXPECT_EQ(map(FreeRunningTime::from_ns(1'004)), LocalTime::from_ns(50'005));
  EXPECT_EQ(map(FreeRunningTime::from_ns(996)), LocalTime::from_ns(49'995));
  EXPECT_EQ(map(FreeRunningTime::from_ns(1'001)), LocalTime{Duration::from_ns(50'001.25)});
  EXPECT_EQ(map.rate(), Rate::from_ratio(1.25));
  EXPECT_EQ(map.from_base(), FreeRunningTime::from_ns(1'000));
  EXPECT_EQ(map.to_base(), LocalTime::from_ns(50'000));
}

TEST(AffineMap, is_exact_to_the_last_bit_in_either_direction_of_time) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> ratios(0.5, 2.0);
  for (int i = 0; i < 100'000; ++i) {
    const auto raw = static_cast<std::int64_t>(random() >> 34) - (std::int64_t{1} << 29);
    const auto elapsed = Duration::from_parts(raw, static_cast<std::uint32_t>(random()));
    const FixedRate rate{Rate::from_ratio(ratios(random))};
    const Map map{FreeRunningTime::from_ns(77), LocalTime::from_ns(-5), rate.rate()};
    const Duration moved = map(FreeRunningTime::from_ns(77) + elapsed) - LocalTime::from_ns(-5);
    // elapsed: 30 + 32 bits, rate: 54 bits.
    ASSERT_EQ(units(moved), (units(elapsed) * static_cast<Wide>(rate.scaled())) >> 53);
  }
}

TEST(AffineMap, serves_a_century_and_a_fast_rate) {
  const Duration century = Nanoseconds{3'155'760'000'000'000'000};
  const Map map{{}, {}, Rate::from_ppb(1.0)};
  // ratio = 1 + 2^-52 round(2^52 1e-9)
  const auto expected =
      3'155'760'000'000'000'000.0L * (static_cast<long double>(Rate::from_ppb(1.0).ratio()) - 1.0L);
  EXPECT_NEAR((map(FreeRunningTime{century}) - LocalTime{century}).ns(),
              static_cast<double>(expected), 1e-6);
  const Map fast{{}, {}, Rate::from_ratio(1000.5)};
  EXPECT_EQ(fast(FreeRunningTime{Duration::from_ns(10.5)}), LocalTime{Duration::from_ns(10505.25)});
}

TEST(AffineMap, inverse_comes_back_to_the_instant) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> ratios(0.9, 1.1);
  for (int i = 0; i < 100'000; ++i) {
    const auto raw =
        static_cast<std::int64_t>(random() >> 12) - (std::int64_t{1} << 51);  // +-26 days
    const auto instant =
        FreeRunningTime{Duration::from_parts(raw, static_cast<std::uint32_t>(random()))};
    const Map map{FreeRunningTime::from_ns(1'000), LocalTime::from_ns(500),
                  Rate::from_ratio(ratios(random))};
    ASSERT_NEAR((map.inverse(map(instant)) - instant).ns(), 0.0, 1e-9);
  }
}

TEST(AffineMap, continued_map_keeps_what_the_display_cut_off) {
  // A third of 2^-32 ns would be lost each time: after 3 million continuations 1e-4 ns.
  const Rate rate = Rate::from_ratio(4.0 / 3.0);
  Map map{{}, {}, rate};
  const auto tick = Duration::from_parts(0, 1);
  FreeRunningTime instant;
  for (int i = 0; i < 3'000'000; ++i) {
    instant = instant + tick;
    map = map.continued(instant, rate);
  }
  const Map once{{}, {}, rate};
  EXPECT_EQ(map(instant), once(instant));
  EXPECT_EQ(map.from_base(), instant);
}

TEST(AffineMap, step_moves_the_line_and_keeps_its_rate) {
  const Map map = Map{{}, LocalTime::from_ns(10), Rate::from_ratio(1.5)}.stepped(Duration{-4ns});
  EXPECT_EQ(map(FreeRunningTime::from_ns(2)), LocalTime::from_ns(9));
  EXPECT_EQ(map.rate(), Rate::from_ratio(1.5));
}

TEST(AffineMap, counter_that_wraps_is_harmless) {
  const auto last = FreeRunningTime::from_ns(std::numeric_limits<std::int64_t>::max());
  const Map map{last, LocalTime::from_ns(0), Rate::from_ratio(1.5)};
  const auto wrapped = last + Duration{100ns};
  EXPECT_LT(wrapped, last);
  EXPECT_EQ(map(wrapped), LocalTime::from_ns(150));
  EXPECT_EQ(map.inverse(LocalTime::from_ns(150)), wrapped);
}

}  // namespace
}  // namespace ftcs
