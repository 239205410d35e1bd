// SPDX-License-Identifier: MIT
#include "ftcs/estimation/wait_density.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

double integral(const WaitDensity& waits) {
  double sum = 0.0;
  for (double edge = 1.0; edge < 1.6e7; edge *= 1.01) sum += 0.01 * edge * waits.at(1.005 * edge);
  return sum;
}

TEST(WaitDensity, starts_as_an_exponential_of_the_mean_wait) {
  WaitDensity waits;
  waits.start(60e3);
  EXPECT_NEAR(integral(waits), 1.0, 0.15);
  for (const double nu : {30e3, 60e3, 90e3}) {
    const double density = std::exp(-nu / 60e3) / 60e3;
    EXPECT_NEAR(waits.at(nu), density, 0.5 * density) << nu;
  }
}

TEST(WaitDensity, short_waits_that_were_seldom_seen_are_as_dense_as_longer_ones) {
  WaitDensity waits;
  waits.start(60e3);
  EXPECT_NEAR(waits.at(100.0) * 60e3, 1.0, 0.6);
  EXPECT_NEAR(waits.at(2.0) / waits.at(3000.0), 1.0, 0.5);
}

TEST(WaitDensity, learns_what_waits_are_like) {
  WaitDensity waits;
  waits.start(60e3);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> even(0.0, 12e3);
  for (int k = 0; k < 3000; ++k) waits.learn(even(random), 1.0);
  EXPECT_NEAR(integral(waits), 1.0, 0.15);
  EXPECT_NEAR(waits.at(5e3) * 12e3, 1.0, 0.3);
  EXPECT_LT(waits.at(100e3) * 12e3, 0.01);
}

TEST(WaitDensity, is_finite_for_every_mean_that_it_holds_and_holds_none_that_it_cannot) {
  for (double mean = 1e-3; mean < 1e9 && WaitDensity::holds(mean); mean *= 1.1) {
    WaitDensity waits;
    waits.start(mean);
    for (double nu = 0.1; nu < 1e12; nu *= 3.0) {
      EXPECT_GT(waits.at(nu), 0.0) << mean;
      EXPECT_LE(waits.at(nu), 1.0) << mean;
    }
  }
  EXPECT_TRUE(WaitDensity::holds(60e6));
  EXPECT_FALSE(WaitDensity::holds(90e6));
}

// Two waits in a hundred are longer than all that were seen, log-uniform.
TEST(WaitDensity, a_wait_beyond_all_that_were_seen_may_be_of_any_size) {
  WaitDensity waits;
  waits.start(60e3);
  std::mt19937_64 random(1);
  std::exponential_distribution<double> wait(1.0 / 60e3);
  for (int k = 0; k < 3000; ++k) waits.learn(wait(random), 1.0);
  double beyond = 0.0;
  for (double edge = 1e6; edge < 1.6e7; edge *= 1.01)
    beyond += 0.01 * edge * waits.at(1.005 * edge);
  EXPECT_GT(beyond, 0.01);
  EXPECT_LT(beyond, 0.03);
}

TEST(WaitDensity, any_wait_is_possible) {
  WaitDensity waits;
  waits.start(1e3);
  for (double nu = 0.1; nu < 1e18; nu *= 3.0) EXPECT_GT(waits.at(nu), 0.0) << nu;
}

}  // namespace
}  // namespace ftcs::estimation
