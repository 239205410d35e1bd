// SPDX-License-Identifier: MIT
// World: instants around zero, ticks of 1 ns, 8 ns and 0.25 ns.
#include "ftcs/sim/quantiser.h"

#include <gtest/gtest.h>

namespace ftcs::sim {
namespace {

double quantised(double ns, double tick_ns) {
  const Quantiser quantise(Duration::from_ns(tick_ns));
  return quantise(LocalTime{Duration::from_ns(ns)}).since_epoch().ns();
}

TEST(Quantiser, takes_the_nearest_tick_on_both_sides_of_zero) {
  EXPECT_EQ(quantised(11.9, 8.0), 8.0);
  EXPECT_EQ(quantised(12.0, 8.0), 16.0);
  EXPECT_EQ(quantised(-3.9, 8.0), 0.0);
  EXPECT_EQ(quantised(-4.1, 8.0), -8.0);
  EXPECT_EQ(quantised(1.4, 1.0), 1.0);
  EXPECT_EQ(quantised(-1.6, 1.0), -2.0);
}

TEST(Quantiser, takes_ticks_below_a_nanosecond) { EXPECT_EQ(quantised(1.3, 0.25), 1.25); }

TEST(Quantiser, leaves_the_instant_alone_without_a_tick) {
  EXPECT_EQ(quantised(1.375, 0.0), 1.375);
}

}  // namespace
}  // namespace ftcs::sim
