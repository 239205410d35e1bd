// SPDX-License-Identifier: MIT
#include "ftcs/experiment/closed_form.h"

#include <cmath>
#include <limits>

namespace ftcs::experiment {

NoiseGain ftcs_noise_gain(double offset_gain) noexcept {
  const double p = offset_gain;
  const double error = p == 0.0 ? 1.0 : (2.0 + 3.0 * p) / (2.0 - p);
  return {error, error + 1.0};
}

NoiseGain pics_noise_gain(double proportional_gain, double integral_gain) noexcept {
  const double a1 = 2.0 - proportional_gain - integral_gain;
  const double a2 = proportional_gain - 1.0;
  const double b0 = -(proportional_gain + integral_gain);
  const double b1 = proportional_gain;
  // Stability triangle of a second-order recursion.
  if (!(std::abs(a2) < 1.0 && std::abs(a1) < 1.0 - a2)) {
    return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }
  // ARMA(2,1): gamma0 = [b0^2 + b1^2 + 2 a1 b0 b1 / (1 - a2)] (1 - a2) / ((1 + a2) ((1 - a2)^2 -
  // a1^2)).
  const double numerator = (b0 * b0 + b1 * b1) * (1.0 - a2) + 2.0 * a1 * b0 * b1;
  const double error = numerator / ((1.0 + a2) * ((1.0 - a2) * (1.0 - a2) - a1 * a1));
  return {error, error + 1.0};
}

}  // namespace ftcs::experiment
