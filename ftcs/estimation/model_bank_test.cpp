// SPDX-License-Identifier: MIT
// World: messages of both directions at irregular times; oracle is a textbook
// Kalman filter on full 3 x 3 matrices, written without regard to speed.
#include "ftcs/estimation/model_bank.h"

#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

/// x, y, d with white FM a, random-walk FM b, delay walk w and noise of
/// variance one (units of s).
struct Textbook {
  std::array<double, 3> m{};
  Matrix p{};
  NoiseModel noise{};

  void predict(double t) {
    const Matrix f = {{{1.0, t, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
    m[0] += t * m[1];
    Matrix fp{};
    Matrix result{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k) fp[i][j] += f[i][k] * p[k][j];
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k) result[i][j] += fp[i][k] * f[j][k];
    p = result;
    const double b = noise.random_walk_fm;
    p[0][0] += noise.white_fm * t + b * t * t * t / 3.0;
    p[0][1] += b * t * t / 2.0;
    p[1][0] += b * t * t / 2.0;
    p[1][1] += b * t;
    p[2][2] += (noise.delay_walk + 1e-9) * t;
  }
  void correct(double sign, double z) {
    const std::array<double, 3> h = {1.0, 0.0, sign};
    std::array<double, 3> ph{};
    double variance = 1.0;
    double residual = z;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) ph[i] += p[i][j] * h[j];
      residual -= h[i] * m[i];
    }
    for (std::size_t i = 0; i < 3; ++i) variance += h[i] * ph[i];
    for (std::size_t i = 0; i < 3; ++i) m[i] += ph[i] / variance * residual;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) p[i][j] -= ph[i] * ph[j] / variance;
  }
};

TEST(ModelBank, every_model_is_the_textbook_filter) {
  constexpr double kScale = 50.0;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> gap(0.01, 3.0);
  ModelBank<FullGrid> bank;
  Estimate start;
  start.xx = 1e6;
  start.yy = 1e4;
  start.dd = 1e6;
  bank.start(start);
  std::array<Textbook, FullGrid::kSize> oracles;
  for (std::size_t i = 0; i < oracles.size(); ++i) {
    oracles[i].p = {{{1e6, 0.0, 0.0}, {0.0, 1e4, 0.0}, {0.0, 0.0, 1e6}}};
    oracles[i].noise = FullGrid::kModels[i];
  }
  double time = 0.0;
  for (int n = 0; n < 200; ++n) {
    const double dt = gap(random);
    time += dt;
    const double sign = random() % 2 == 0 ? 1.0 : -1.0;
    const double z = 300.0 * time + sign * 7000.0 + kScale * normal(random);
    ASSERT_TRUE(bank.predict(dt, 0));
    const auto innovations = bank.judge({sign, dt, z}, DelayShape{}, kScale, {}, false);
    bank.correct({sign, dt, z}, kScale, innovations);
    for (Textbook& oracle : oracles) {
      oracle.predict(dt);
      oracle.correct(sign, z);
    }
  }
  EXPECT_TRUE(bank.healthy());
  for (std::size_t i = 0; i < oracles.size(); ++i) {
    const Estimate e = bank.estimate(i);
    EXPECT_NEAR(e.x, oracles[i].m[0], 1e-6 * std::abs(e.x)) << i;
    EXPECT_NEAR(e.y, oracles[i].m[1], 1e-5 * std::abs(e.y) + 1e-3) << i;
    EXPECT_NEAR(e.d, oracles[i].m[2], 1e-5 * std::abs(e.d)) << i;
    EXPECT_NEAR(e.xx, oracles[i].p[0][0], 1e-5 * oracles[i].p[0][0]) << i;
    EXPECT_NEAR(e.yy, oracles[i].p[1][1], 1e-5 * oracles[i].p[1][1]) << i;
    EXPECT_NEAR(e.dd, oracles[i].p[2][2], 1e-5 * oracles[i].p[2][2]) << i;
  }
}

TEST(ModelBank, an_outlier_gets_no_credit_and_moves_nothing) {
  ModelBank<FullGrid> bank;
  Estimate start;
  start.xx = start.yy = start.dd = 1e-3;
  bank.start(start);
  const Observation late{1.0, 0.0, 1e5};
  const auto innovations = bank.judge(late, DelayShape{}, 100.0, {0.03, 1e-5}, true);
  bank.correct(late, 100.0, innovations);
  EXPECT_LT(innovations.credit[0], 1e-6);
  EXPECT_NEAR(bank.estimate(0).x, 0.0, 1e-3);
}

TEST(ModelBank, an_early_packet_is_less_likely_an_outlier_than_a_late_one) {
  ModelBank<FullGrid> bank;
  Estimate start;
  start.xx = start.yy = start.dd = 1e-3;
  bank.start(start);
  const auto late = bank.judge({1.0, 0.0, 400.0}, DelayShape{}, 100.0, {0.03, 1e-5}, true);
  const auto early = bank.judge({1.0, 0.0, -400.0}, DelayShape{}, 100.0, {0.03, 1e-5}, true);
  EXPECT_LT(late.credit[0], early.credit[0]);
  EXPECT_GT(early.credit[0], 0.9);
}

TEST(ModelBank, mixture_contains_the_spread_between_the_models) {
  ModelBank<FullGrid> bank;
  Estimate one;
  one.x = 10.0;
  one.xx = one.yy = one.dd = 1.0;
  bank.start(one);
  one.x = 30.0;
  bank.set(3, one);
  ModelBank<FullGrid>::Row weight{};
  weight[2] = weight[3] = 0.5;
  const Estimate mixed = bank.mixture(weight, weight, 2.0);
  EXPECT_DOUBLE_EQ(mixed.x, 20.0);
  EXPECT_DOUBLE_EQ(mixed.xx, 1.0 + 100.0 / 4.0);
}

}  // namespace
}  // namespace ftcs::estimation
