// SPDX-License-Identifier: MIT
#include "ftcs/time/duration.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

TEST(Duration, keeps_whole_nanoseconds_exactly) {
  EXPECT_EQ(Duration{1ms}.floor_ns(), 1'000'000);
  EXPECT_EQ(Duration{-7ns}.floor_ns(), -7);
  EXPECT_EQ((Duration{5ns} - Duration{8ns}).floor_ns(), -3);
}

TEST(Duration, fraction_counts_upwards_from_the_whole_below) {
  const auto minus_a_quarter = Duration::from_ns(-0.25);
  EXPECT_EQ(minus_a_quarter.floor_ns(), -1);
  EXPECT_EQ(minus_a_quarter.fraction(), 0xC0000000U);
  EXPECT_DOUBLE_EQ(minus_a_quarter.ns(), -0.25);
  EXPECT_EQ((-minus_a_quarter).ns(), 0.25);
  EXPECT_EQ(minus_a_quarter.rounded_ns(), 0);
  EXPECT_EQ(Duration::from_ns(-0.75).rounded_ns(), -1);
}

TEST(Duration, negation_and_sum_are_exact_inverses) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100'000; ++i) {
    const auto a = Duration::from_parts(static_cast<std::int64_t>(random()) / 4,
                                        static_cast<std::uint32_t>(random()));
    const auto b = Duration::from_parts(static_cast<std::int64_t>(random()) / 4,
                                        static_cast<std::uint32_t>(random()));
    ASSERT_EQ(a + b - b, a);
    ASSERT_EQ(-(-a), a);
    ASSERT_EQ(a - a, Duration{});
    ASSERT_EQ(a<b, b - a> Duration{});
    ASSERT_EQ(a.half() + a.half() + Duration::from_parts(0, a.fraction() & 1U), a);
  }
}

TEST(Duration, reads_the_units_of_correction_field) {
  EXPECT_EQ(Duration::from_scaled_ns(0x0000'0000'0002'8000).ns(),
            2.5);  // IEEE 1588-2019, 5.3.2: 2.5 ns
  EXPECT_EQ(Duration::from_scaled_ns(-0x8000).ns(), -0.5);
}

TEST(Duration, from_ns_saturates_and_never_invents_a_number) {
  EXPECT_EQ(Duration::from_ns(std::numeric_limits<double>::quiet_NaN()), Duration{});
  EXPECT_EQ(Duration::from_ns(std::numeric_limits<double>::infinity()).floor_ns(),
            std::int64_t{1} << 62);
  EXPECT_EQ(Duration::from_ns(-1e300).floor_ns(), -(std::int64_t{1} << 62));
  EXPECT_EQ(Duration::from_ns(-1e-12).ns(), 0.0);
}

TEST(Duration, overflow_wraps_instead_of_being_undefined) {
  const auto most = Duration::from_whole_ns(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ((most + Duration{1ns}).floor_ns(), std::numeric_limits<std::int64_t>::min());
  const auto least = Duration::from_whole_ns(std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(-least, least);
}

}  // namespace
}  // namespace ftcs
