// SPDX-License-Identifier: MIT
// World: rates of a servo, eight a second.
#include "ftcs/platform/kept_rate.h"

#include <random>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

constexpr std::int64_t kInterval = 125'000'000;

TEST(KeptRate, is_the_first_one_until_one_has_proved_itself) {
  KeptRate kept(Rate::from_ppm(7.0));
  EXPECT_DOUBLE_EQ(kept.rate().ratio(), Rate::from_ppm(7.0).ratio());
  kept.note(Rate::from_ppm(7.00001), 0);
  EXPECT_DOUBLE_EQ(kept.rate().ratio(), Rate::from_ppm(7.00001).ratio());
}

TEST(KeptRate, has_less_noise_than_each_of_the_rates) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise_ppb(0.0, 10.0);
  KeptRate kept(Rate{});
  double squares = 0.0;
  for (int i = 0; i < 8'000; ++i) {
    kept.note(Rate::from_ppb(20'000.0 + noise_ppb(random)), i * kInterval);
    if (i > 100) squares += std::pow(kept.rate().ppb() - 20'000.0, 2);
  }
  EXPECT_LT(std::sqrt(squares / 7'900.0), 10.0 / 5.0);
}

TEST(KeptRate, follows_a_change_that_is_no_noise_at_once) {
  KeptRate kept(Rate{});
  for (int i = 0; i < 100; ++i) kept.note(Rate::from_ppm(20.0), i * kInterval);
  kept.note(Rate::from_ppm(21.0), 100 * kInterval);
  EXPECT_DOUBLE_EQ(kept.rate().ratio(), Rate::from_ppm(21.0).ratio());
}

TEST(KeptRate, counts_time_and_not_how_often_it_is_told) {
  KeptRate kept(Rate{});
  kept.note(Rate::from_ppb(100.0), 0);
  for (int i = 0; i < 100; ++i) kept.note(Rate::from_ppb(110.0), 1'000);
  EXPECT_NEAR(kept.rate().ppb(), 100.0, 0.01);
  kept.note(Rate::from_ppb(110.0), 4'000'000'000);
  EXPECT_NEAR(kept.rate().ppb(), 110.0, 0.01);
}

}  // namespace
}  // namespace ftcs::platform
