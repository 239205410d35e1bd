// SPDX-License-Identifier: MIT
// World: innovations of a filter that is nearly exact, so that they are the
// delay noise itself.
#include "ftcs/estimation/noise_learner.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

class NoiseLearnerTest : public ::testing::Test {
 protected:
  void feed(double innovation) {
    (void)learner_.learn({innovation, 0.01, 100.0, true}, DelayShape{});
  }

  NoiseLearner<32> learner_;
  std::mt19937_64 random_{3};
  std::normal_distribution<double> normal_{0.0, 100.0};
  std::exponential_distribution<double> queue_{1e-2};
};

TEST_F(NoiseLearnerTest, normal_noise_has_its_variance_and_no_tail) {
  for (int i = 0; i < 2000; ++i) feed(normal_(random_));
  const DelayShape shape = learner_.decide(learner_.plead());
  EXPECT_EQ(shape.tail, 0.0);
  EXPECT_NEAR(std::sqrt(shape.variance), 100.0, 8.0);
}

TEST_F(NoiseLearnerTest, queueing_is_recognised_and_its_mean_measured) {
  for (int i = 0; i < 2000; ++i) feed(queue_(random_));
  const DelayShape shape = learner_.decide(learner_.plead());
  EXPECT_TRUE(learner_.has_tail());
  EXPECT_NEAR(shape.tail, 100.0, 10.0);
  EXPECT_LT(shape.variance, 0.1 * shape.tail * shape.tail);
}

TEST_F(NoiseLearnerTest, outliers_are_not_noise) {
  for (int i = 0; i < 2000; ++i) feed(normal_(random_) + (i % 10 == 0 ? 1e5 : 0.0));
  EXPECT_NEAR(std::sqrt(learner_.decide(learner_.plead()).variance), 100.0, 10.0);
}

TEST_F(NoiseLearnerTest, bursts_of_any_size_are_no_queue) {
  // Their moments ask for a tail, and its floor would be 100 ns too early.
  std::exponential_distribution<double> burst(1.0 / 5'000.0);
  for (int i = 0; i < 2000; ++i) feed(normal_(random_) + (i % 10 == 0 ? burst(random_) : 0.0));
  EXPECT_EQ(learner_.decide(learner_.plead()).tail, 0.0);
}

TEST_F(NoiseLearnerTest, the_filters_own_error_is_not_noise) {
  std::normal_distribution<double> both(0.0, 100.0 * std::sqrt(1.4));
  for (int i = 0; i < 3000; ++i) (void)learner_.learn({both(random_), 0.4, 100.0, true}, {});
  EXPECT_NEAR(std::sqrt(learner_.decide(learner_.plead()).variance), 100.0, 8.0);
}

TEST_F(NoiseLearnerTest, waits_while_the_filters_are_unsettled) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(learner_.learn({normal_(random_), 0.01, 100.0, false}, {}));
    EXPECT_FALSE(learner_.learn({normal_(random_), 5.0, 100.0, true}, {}));
  }
  EXPECT_FALSE(learner_.mature());
}

TEST_F(NoiseLearnerTest, follows_when_the_noise_shrinks) {
  for (int i = 0; i < 1000; ++i) feed(normal_(random_));
  for (int i = 0; i < 200; ++i) feed(normal_(random_) / 10.0);
  EXPECT_LT(std::sqrt(learner_.decide(learner_.plead()).variance), 25.0);
}

}  // namespace
}  // namespace ftcs::estimation
