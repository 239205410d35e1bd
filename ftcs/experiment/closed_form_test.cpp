// SPDX-License-Identifier: MIT
// World: none; the formulas against their own recursions, summed term by term.
#include "ftcs/experiment/closed_form.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ftcs::experiment {
namespace {

/// Sum of squares of the response of theta to one unit of noise.
double summed_response(double kp, double ki) {
  double current = -(kp + ki);
  double previous = 0.0;
  double sum = current * current;
  double next = (2.0 - kp - ki) * current + kp;
  for (int i = 0; i < 10'000; ++i) {
    previous = current;
    current = next;
    sum += current * current;
    next = (2.0 - kp - ki) * current - (1.0 - kp) * previous;
  }
  return sum;
}

TEST(ClosedForm, pics_variance_is_the_summed_impulse_response) {
  for (const auto& [kp, ki] : {std::pair{0.5, 0.3}, {0.2, 0.3}, {0.9, 0.1}, {0.7, 0.05}}) {
    EXPECT_NEAR(pics_noise_gain(kp, ki).time_error, summed_response(kp, ki), 1e-9);
  }
}

TEST(ClosedForm, deadbeat_servos_are_the_same_filter) {
  EXPECT_DOUBLE_EQ(ftcs_noise_gain(1.0).time_error, 5.0);
  EXPECT_DOUBLE_EQ(pics_noise_gain(1.0, 1.0).time_error, 5.0);
}

TEST(ClosedForm, ftcs_is_the_incremental_pi_with_kp_one_and_ki_p) {
  for (const double p : {0.5, 1.0 / 64.0}) {
    EXPECT_NEAR(ftcs_noise_gain(p).time_error, pics_noise_gain(1.0, p).time_error, 1e-12);
  }
}

TEST(ClosedForm, an_unstable_loop_has_no_finite_variance) {
  EXPECT_TRUE(std::isinf(pics_noise_gain(2.5, 1.0).time_error));
}

}  // namespace
}  // namespace ftcs::experiment
