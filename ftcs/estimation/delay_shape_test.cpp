// SPDX-License-Identifier: MIT
// World: one innovation under known noise; oracles are numerical integration
// and differences.
#include "ftcs/estimation/delay_shape.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

/// Density of normal(0, spread) + exponential(tail), integrated by brute force.
double convolved(double nu, double spread, double tail) {
  const double sigma = std::sqrt(spread);
  const double step = sigma / 200.0;
  double sum = 0.0;
  for (double e = -8.0 * sigma; e < 8.0 * sigma; e += step) {
    const double middle = e + step / 2.0;
    if (middle > nu) break;
    const double normal =
        std::exp(-0.5 * middle * middle / spread) / (sigma * std::sqrt(2.0 * std::numbers::pi));
    sum += normal * std::exp(-(nu - middle) / tail) / tail * step;
  }
  return sum;
}

TEST(DelayShape, late_density_is_the_convolution) {
  for (double tail : {0.5, 1.0, 3.0}) {
    for (double nu : {-2.0, -0.5, 0.0, 1.0, 4.0, 12.0}) {
      EXPECT_NEAR(late_score(nu, 1.0, tail).log_density, std::log(convolved(nu, 1.0, tail)), 0.01)
          << "nu " << nu << " tail " << tail;
    }
  }
}

TEST(DelayShape, slope_and_curvature_are_the_derivatives_of_the_density) {
  const double h = 1e-3;
  for (double spread : {0.01, 1.0, 7.0}) {
    for (double nu = -20.0; nu <= 20.0; nu += 0.7) {
      const Score score = late_score(nu, spread, 1.0);
      const double before = late_score(nu - h, spread, 1.0).log_density;
      const double after = late_score(nu + h, spread, 1.0).log_density;
      const double slope = -(after - before) / (2.0 * h);
      EXPECT_NEAR(score.slope, slope, 1e-4 * std::abs(slope) + 1e-5) << nu << " " << spread;
      const double curvature = -(after - 2.0 * score.log_density + before) / (h * h);
      EXPECT_NEAR(score.curvature, curvature, 2e-3 * std::abs(curvature) + 1e-4)
          << nu << " " << spread;
    }
  }
}

TEST(DelayShape, a_short_tail_is_a_shifted_normal) {
  const Score late = late_score(3.0, 100.0, 1.0);
  const Score normal = normal_score(2.0, 101.0);
  EXPECT_DOUBLE_EQ(late.slope, normal.slope);
  EXPECT_DOUBLE_EQ(late.log_density, normal.log_density);
}

TEST(DelayShape, standard_shape_has_zero_mean_and_unit_variance) {
  for (double k : {0.75, 0.9, 0.99}) {
    double mass = 0.0, mean = 0.0, variance = 0.0;
    const double step = 1e-3;
    for (double w = -10.0; w < 40.0; w += step) {
      const double density = std::exp(standard_late_log_density(w, k)) * step;
      mass += density;
      mean += w * density;
      variance += w * w * density;
    }
    EXPECT_NEAR(mass, 1.0, 1e-3) << k;
    EXPECT_NEAR(mean, 0.0, 2e-3) << k;
    EXPECT_NEAR(variance, 1.0, 5e-3) << k;
  }
}

TEST(DelayShape, stays_finite_for_absurd_innovations) {
  for (double nu : {-1e18, -1e9, 1e9, 1e18}) {
    for (double spread : {1e-8, 1.0, 1e20}) {
      for (double tail : {1e-4, 1.0, 1e6}) {
        const Score score = late_score(nu, spread, tail);
        EXPECT_TRUE(std::isfinite(score.slope)) << nu << " " << spread << " " << tail;
        EXPECT_TRUE(std::isfinite(score.log_density)) << nu << " " << spread << " " << tail;
        EXPECT_GT(score.curvature, 0.0) << nu << " " << spread << " " << tail;
      }
    }
  }
}

}  // namespace
}  // namespace ftcs::estimation
