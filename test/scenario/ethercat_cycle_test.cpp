// SPDX-License-Identifier: MIT
// The world of cycle_of_drives.h: what a cycle in phase with its drives looks like.
#include "test/scenario/cycle_of_drives.h"

namespace ftcs::ethercat {
namespace {

using test::CycleOfDrives;

INSTANTIATE_TEST_SUITE_P(Laws, CycleOfDrives,
                         ::testing::Values(CycleLaw::kFtcs, CycleLaw::kPics, CycleLaw::kAdaptive));

TEST_P(CycleOfDrives, stays_in_phase_and_in_op_without_a_missed_window) {
  to_op();
  for (int i = 0; i < 5000; ++i) {
    cycle();
    ASSERT_LT(std::abs(true_error()), 1000.0);
  }
  expect_all_in_op();
  EXPECT_EQ(main().counters().wrong_working_counter, 0U);
  for (std::size_t n = 0; n < 8; ++n) {
    EXPECT_EQ(segment()[n].drive().statistics().missed, 0U);
    EXPECT_LT(std::abs(segment()[n].system_time_difference()), 100);
  }
}

}  // namespace
}  // namespace ftcs::ethercat
