// SPDX-License-Identifier: MIT
#include "ftcs/time/rate.h"

#include <limits>

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

TEST(Rate, composes_by_multiplication) {
  const Rate both = Rate::from_ppm(8000.0) * Rate::from_ppm(50.0);
  EXPECT_NEAR(both.ppb(), 8'050'400.0, 1e-3);  // 400 ppb that a sum would lose
  EXPECT_NEAR((both / Rate::from_ppm(50.0)).ppm(), 8000.0, 1e-9);
  EXPECT_NEAR(both.inverse().ratio() * both.ratio(), 1.0, 1e-15);
}

TEST(Rate, scaling_keeps_the_fraction_of_a_nanosecond) {
  EXPECT_NEAR(scale(Duration{100us}, Rate::from_ppb(1.0)).ns() - 100'000.0, 1e-4, 1e-9);
  const Duration year = Nanoseconds{31'557'600'000'000'000};
  EXPECT_EQ(scale(year, Rate{}), year);
}

TEST(RateLimits, clamp_never_lets_a_bad_rate_through) {
  const auto limits = RateLimits::symmetric_ppb(500'000.0);
  EXPECT_EQ(limits.clamp(Rate::from_ppm(600.0)), limits.fastest);
  EXPECT_EQ(limits.clamp(Rate::from_ppm(-600.0)), limits.slowest);
  EXPECT_EQ(limits.clamp(Rate::from_ratio(std::numeric_limits<double>::quiet_NaN())), Rate{});
  EXPECT_EQ(limits.clamp(Rate::from_ratio(std::numeric_limits<double>::infinity())),
            limits.fastest);
  EXPECT_EQ(limits.clamp(Rate::from_ratio(-3.0)), limits.slowest);
  EXPECT_TRUE(limits.valid());
  EXPECT_FALSE(RateLimits::symmetric_ppb(1e9).valid());
  EXPECT_EQ(intersect(limits, RateLimits::symmetric_ppb(100.0)).fastest, Rate::from_ppb(100.0));
}

}  // namespace
}  // namespace ftcs
