// SPDX-License-Identifier: MIT
// World: offset records written by hand, band 500 ns as in Section IV of the paper.
#include "ftcs/analysis/convergence.h"

#include <gtest/gtest.h>

#include "ftcs/analysis/statistics.h"

namespace ftcs {
namespace {

constexpr double kBand = 500.0;

TEST(Convergence, is_the_first_sample_from_which_the_band_is_never_left) {
  const double offsets[] = {21000.0, 100.0, -600.0, 499.0, 0.0, -499.0};
  EXPECT_EQ(find_convergence(offsets, kBand).settled, 3U);
}

TEST(Convergence, never_happens_when_the_last_sample_is_outside) {
  const double offsets[] = {0.0, 0.0, 500.0};
  EXPECT_FALSE(find_convergence(offsets, kBand).settled.has_value());
  EXPECT_FALSE(find_convergence({}, kBand).settled.has_value());
}

TEST(Convergence, dwells_at_the_start_of_the_first_long_enough_run) {
  const double offsets[] = {0.0, 900.0, 1.0, 2.0, 3.0, 900.0, 1.0};
  const Convergence record = find_convergence(offsets, kBand, 3);
  EXPECT_EQ(record.dwelt, 2U);
  EXPECT_EQ(record.settled, 6U);
  EXPECT_FALSE(find_convergence(offsets, kBand, 4).dwelt.has_value());
}

TEST(Convergence, counts_from_the_named_origin) {
  ConvergenceTracker tracker(kBand);
  tracker.add(21000.0);
  tracker.add(22000.0, true);  // the servo acts on its second sample
  tracker.add(50.0, true);
  tracker.add(-20.0, true);
  EXPECT_EQ(tracker.result().cycles_to_converge(ConvergenceOrigin::kFirstMessage), 2U);
  EXPECT_EQ(tracker.result().cycles_to_converge(ConvergenceOrigin::kFirstAction), 1U);
  EXPECT_EQ(tracker.result().cycles_to_dwell(ConvergenceOrigin::kFirstAction), 1U);
}

TEST(Convergence, has_no_count_from_an_action_that_never_came) {
  const double offsets[] = {900.0, 0.0};
  const Convergence record = find_convergence(offsets, kBand);
  EXPECT_FALSE(record.cycles_to_converge(ConvergenceOrigin::kFirstAction).has_value());
}

TEST(Convergence, takes_zero_cycles_when_the_record_starts_in_the_band) {
  ConvergenceTracker tracker(kBand);
  tracker.add(1.0);
  tracker.add(1.0, true);
  EXPECT_EQ(tracker.result().cycles_to_converge(ConvergenceOrigin::kFirstAction), 0U);
}

TEST(Convergence, does_not_vouch_for_a_missing_sample) {
  const double offsets[] = {0.0, kNoFigure, 0.0};
  EXPECT_EQ(find_convergence(offsets, kBand).settled, 2U);
}

}  // namespace
}  // namespace ftcs
