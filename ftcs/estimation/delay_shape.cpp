// SPDX-License-Identifier: MIT
#include "ftcs/estimation/delay_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/elementary.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

constexpr double kSmallestCurvature = 1e-12;

/// phi(u) / Phi(u), the inverse Mills ratio at -u.
double hazard(double u) noexcept {
  constexpr double kRootHalfPi = 1.2533141373155003;
  if (u <= 0.0) return 1.0 / (kRootHalfPi * scaled_erfc(-u / std::numbers::sqrt2));
  const double phi = quick_exp(-0.5 * u * u - 0.5 * kLn2Pi);
  return phi / (1.0 - phi * kRootHalfPi * scaled_erfc(u / std::numbers::sqrt2));
}

}  // namespace

Score normal_score(double innovation, double spread) noexcept {
  return {innovation / spread, 1.0 / spread,
          -0.5 * (innovation * innovation / spread + quick_log(spread) + kLn2Pi)};
}

Score late_score(double innovation, double spread, double tail) noexcept {
  if (spread >= 16.0 * tail * tail) {
    return normal_score(innovation - tail, spread + tail * tail);
  }
  const double sigma = std::sqrt(spread);
  const double u = (innovation - spread / tail) / sigma;
  // Eight sigma late the normal part no longer matters.
  if (u > 0.0 && u * u >= kEightSigma) {
    return {1.0 / tail, kSmallestCurvature / spread,
            -quick_log(tail) + spread / (2.0 * tail * tail) - innovation / tail};
  }
  const double lambda = hazard(u);
  return {1.0 / tail - lambda / sigma, std::max(lambda * (u + lambda), kSmallestCurvature) / spread,
          -quick_log(tail) - innovation * innovation / (2.0 * spread) - 0.5 * kLn2Pi -
              quick_log(lambda)};
}

double standard_late_log_density(double w, double k) noexcept {
  return late_score(w + k, 1.0 - k * k, k).log_density;
}

}  // namespace ftcs::estimation
