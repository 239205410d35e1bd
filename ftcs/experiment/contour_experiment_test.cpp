// SPDX-License-Identifier: MIT
// The world: contour_experiment.h's, shorter, and with a reference so far off that the frame
// without a servo wanders through SYNC0 in the time.
#include "ftcs/experiment/contour_experiment.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ftcs::experiment {
namespace {

ContourWorld short_world() {
  ContourWorld world;
  world.reference_ppm = 100.0;
  world.measured_s = 4.0;
  return world;
}

TEST(Contour, without_a_servo_windows_are_missed_the_circle_is_left_and_a_drive_faults) {
  const ContourRow row = run_contour(short_world(), CycleLaw::kNone, 1);
  EXPECT_GT(row.missed_windows, 20U);
  EXPECT_GT(row.max_um, 5.0);
  EXPECT_FALSE(std::isnan(row.first_fault_s));
}

class Synchronised : public ::testing::TestWithParam<CycleLaw> {};
INSTANTIATE_TEST_SUITE_P(Laws, Synchronised,
                         ::testing::Values(CycleLaw::kPics, CycleLaw::kFtcs, CycleLaw::kAdaptive));

TEST_P(Synchronised, stays_on_the_circle_to_the_rounding_of_its_counts) {
  const ContourRow row = run_contour(short_world(), GetParam(), 1);
  EXPECT_EQ(row.missed_windows, 0U);
  EXPECT_GE(row.windows, 2U * 3999U);
  EXPECT_LT(row.max_um, 2.0);
  EXPECT_TRUE(std::isnan(row.first_fault_s));
}

TEST(Contour, is_the_same_for_the_same_seed) {
  const ContourRow one = run_contour(short_world(), CycleLaw::kFtcs, 3);
  const ContourRow two = run_contour(short_world(), CycleLaw::kFtcs, 3);
  EXPECT_EQ(one.trace_um, two.trace_um);
}

}  // namespace
}  // namespace ftcs::experiment
