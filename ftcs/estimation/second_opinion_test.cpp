// SPDX-License-Identifier: MIT
// World: messages of both directions in turn, twice a cycle, on a line of known
// offset, rate and path delay, with normal noise of 100 ns; innovations are
// what some filter thought of them.
#include "ftcs/estimation/second_opinion.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

class SecondOpinionTest : public ::testing::Test {
 protected:
  static constexpr double kX = 1e6;
  static constexpr double kY = 5e4;
  static constexpr double kD = 1e4;

  /// Feeds one message; `late` is added to its delay.
  void feed(double late, double innovation) {
    const double sign = count_ % 2 == 0 ? 1.0 : -1.0;
    const double age = 0.5 * (15 - count_);  // the sixteenth message defines t = 0
    const double noise = 100.0 * normal_(random_) + late;
    opinion_.push({sign, count_ == 0 ? 0.0 : 0.5, kX - kY * age + sign * (kD + noise)}, innovation);
    ++count_;
  }

  SecondOpinion<16> opinion_;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
  int count_ = 0;
};

TEST_F(SecondOpinionTest, finds_the_line_under_outliers_when_the_filters_are_lost) {
  for (int i = 0; i < 16; ++i) feed(i == 3 || i == 8 || i == 14 ? 1e5 : 0.0, 2e4);
  const FreshFit fit = opinion_.consult({true, 0.0});
  EXPECT_TRUE(fit.better);
  EXPECT_NEAR(fit.estimate.x, kX, 400.0);
  EXPECT_NEAR(fit.estimate.y, kY, 100.0);
  EXPECT_NEAR(fit.estimate.d, kD, 300.0);
  EXPECT_LT(fit.scale_ns, 300.0);
}

TEST_F(SecondOpinionTest, covariance_is_that_of_least_squares) {
  for (int i = 0; i < 16; ++i) feed(0.0, 2e4);
  const FreshFit fit = opinion_.consult({true, 0.0});
  // Six of eight messages a direction are kept. Newest point of a line through
  // N uniform points: variance about 4 / N; the delay: 1 / N.
  EXPECT_NEAR(fit.estimate.xx, 4.0 / 12.0, 0.2);
  EXPECT_NEAR(fit.estimate.dd, 1.0 / 12.0, 0.03);
  EXPECT_GT(fit.estimate.yy, 0.0);
}

TEST_F(SecondOpinionTest, agrees_with_filters_that_see_the_noise_as_it_is) {
  for (int run = 0; run < 2000; ++run) {
    opinion_.clear();
    count_ = 0;
    for (int i = 0; i < 16; ++i) feed(0.0, 100.0 * normal_(random_));
    ASSERT_FALSE(opinion_.consult({true, 0.0}).better);
  }
}

TEST_F(SecondOpinionTest, a_loaded_direction_alone_is_no_contradiction) {
  std::exponential_distribution<double> queue(1e-3);
  for (int run = 0; run < 2000; ++run) {
    opinion_.clear();
    count_ = 0;
    for (int i = 0; i < 16; ++i) {
      const double late = i % 2 == 0 ? queue(random_) : 0.0;
      feed(late, late + 100.0 * normal_(random_));
    }
    ASSERT_FALSE(opinion_.consult({true, 0.0}).better);
  }
}

TEST_F(SecondOpinionTest, has_no_opinion_on_a_few_messages) {
  for (int i = 0; i < 6; ++i) feed(0.0, 1e9);
  EXPECT_FALSE(opinion_.consult({true, 0.0}).better);
}

TEST_F(SecondOpinionTest, one_direction_with_a_known_delay_suffices) {
  for (int i = 0; i < 16; ++i) {
    opinion_.push({1.0, i == 0 ? 0.0 : 1.0, kX + kY * (i - 15) + kD + 100.0 * normal_(random_)},
                  1e6);
  }
  const FreshFit fit = opinion_.consult({false, kD});
  EXPECT_TRUE(fit.better);
  EXPECT_NEAR(fit.estimate.x, kX, 300.0);
  EXPECT_DOUBLE_EQ(fit.estimate.d, kD);
}

/// Stamps of whole nanoseconds of a clock that is steered to the reference.
TEST_F(SecondOpinionTest, a_line_to_the_digit_is_no_better_than_innovations_below_the_rounding) {
  for (const double innovation : {0.1, 100.0}) {
    opinion_.clear();
    for (int i = 0; i < 16; ++i) {
      const double sign = i % 2 == 0 ? 1.0 : -1.0;
      opinion_.push({sign, i == 0 ? 0.0 : 0.5, kX + kY * 0.5 * (i - 15) + sign * kD}, innovation);
    }
    EXPECT_TRUE(opinion_.consult({true, 0.0}).better) << innovation;
    EXPECT_EQ(opinion_.consult({true, 0.0, 10.0, 0.4}).better, innovation > 1.0) << innovation;
  }
}

TEST_F(SecondOpinionTest, gives_the_last_messages_in_their_order) {
  for (int i = 0; i < 3; ++i) feed(0.0, 0.0);
  const LastMessages few = opinion_.last();
  ASSERT_EQ(few.count, 3U);
  EXPECT_EQ(few.messages[0].sign, 1.0);
  EXPECT_EQ(few.messages[0].elapsed, 0.0) << "nothing is before it";

  for (int i = 0; i < 18; ++i) feed(0.0, 0.0);
  const Observation newest{-1.0, 0.25, 12'345.0};
  opinion_.push(newest, 0.0);
  const LastMessages all = opinion_.last();
  ASSERT_EQ(all.count, all.messages.size());
  EXPECT_EQ(all.messages.back().z, newest.z);
  EXPECT_EQ(all.messages.back().sign, newest.sign);
  EXPECT_DOUBLE_EQ(all.messages.back().elapsed, newest.elapsed);
  EXPECT_DOUBLE_EQ(all.messages[1].elapsed, 0.5);
}

}  // namespace
}  // namespace ftcs::estimation
