// SPDX-License-Identifier: MIT
// World: a series of offsets in nanoseconds, and a band that is entered below 50 and left at 500.
#include "ftcs/servo/converged_band.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

constexpr ConvergedBand kBand{Nanoseconds{50}, Nanoseconds{500}};

TEST(ConvergedBand, is_valid_when_it_can_be_left_no_earlier_than_entered) {
  EXPECT_TRUE(ConvergedBand{}.valid());
  EXPECT_TRUE((ConvergedBand{Duration{}, Duration{}}.valid()));
  EXPECT_TRUE((ConvergedBand{Nanoseconds{1}, Nanoseconds{1}}.valid()));
  EXPECT_FALSE((ConvergedBand{Nanoseconds{2}, Nanoseconds{1}}.valid()));
  EXPECT_FALSE((ConvergedBand{Nanoseconds{-1}, Nanoseconds{1}}.valid()));
}

TEST(ConvergenceLatch, closes_below_enter_and_opens_at_leave) {
  ConvergenceLatch latch;
  EXPECT_FALSE(latch.closed());
  EXPECT_FALSE(latch.update(50.0, kBand, 1));
  EXPECT_FALSE(latch.update(-50.0, kBand, 1));
  EXPECT_TRUE(latch.update(-49.9, kBand, 1));
  EXPECT_TRUE(latch.closed());
  EXPECT_TRUE(latch.update(499.9, kBand, 1));
  EXPECT_TRUE(latch.update(-499.9, kBand, 1));
  EXPECT_FALSE(latch.update(-500.0, kBand, 1));
  EXPECT_FALSE(latch.closed());
  EXPECT_FALSE(latch.update(60.0, kBand, 1));
  EXPECT_TRUE(latch.update(49.9, kBand, 1));
  EXPECT_FALSE(latch.update(500.0, kBand, 1));
}

TEST(ConvergenceLatch, dwell_counts_consecutive_offsets_and_zero_is_one) {
  ConvergenceLatch latch;
  EXPECT_FALSE(latch.update(0.0, kBand, 2));
  EXPECT_FALSE(latch.update(50.0, kBand, 2));
  EXPECT_FALSE(latch.update(0.0, kBand, 2));
  EXPECT_TRUE(latch.update(0.0, kBand, 2));
  EXPECT_FALSE(latch.update(500.0, kBand, 2));
  EXPECT_FALSE(latch.update(0.0, kBand, 2));  // what was counted before it opened is void
  EXPECT_TRUE(latch.update(0.0, kBand, 2));
  ConvergenceLatch at_once;
  EXPECT_FALSE(at_once.update(50.0, kBand, 0));
  EXPECT_TRUE(at_once.update(49.0, kBand, 0));
}

TEST(ConvergenceLatch, without_a_bound_every_offset_is_inside) {
  ConvergenceLatch latch;
  EXPECT_TRUE(latch.update(-1e15, ConvergedBand{}, 1));
  EXPECT_TRUE(latch.update(1e15, ConvergedBand{}, 1));
}

}  // namespace
}  // namespace ftcs
