// SPDX-License-Identifier: MIT
// World: figures as people read them.
#include "ftcs/report/number_format.h"

#include <limits>

#include <gtest/gtest.h>

#include "ftcs/analysis/statistics.h"

namespace ftcs {
namespace {

TEST(NumberFormat, keeps_the_digits_that_are_asked_for) {
  EXPECT_EQ(significant(12.5), "12.50");
  EXPECT_EQ(significant(1234.4), "1234");
  EXPECT_EQ(significant(-0.001), "-0.001000");
  EXPECT_EQ(significant(0.0), "0");
  EXPECT_EQ(fixed(2.345, 1), "2.3");
}

TEST(NumberFormat, shows_no_figure_as_a_dash) {
  EXPECT_EQ(significant(kNoFigure), "-");
  EXPECT_EQ(fixed(std::numeric_limits<double>::infinity(), 1), "-");
  EXPECT_EQ(seconds_text(kNoFigure), "-");
  EXPECT_EQ(fraction_text(kNoFigure), "-");
}

TEST(NumberFormat, picks_the_unit_that_suits) {
  EXPECT_EQ(seconds_text(12.5e-9), "12.50 ns");
  EXPECT_EQ(seconds_text(-1.25e-6), "-1.250 us");
  EXPECT_EQ(seconds_text(3.0), "3.000 s");
  EXPECT_EQ(seconds_text(0.0), "0 ns");
  EXPECT_EQ(fraction_text(3.2e-9), "3.200 ppb");
  EXPECT_EQ(fraction_text(-50e-6), "-50.00 ppm");
}

}  // namespace
}  // namespace ftcs
