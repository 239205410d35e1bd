// SPDX-License-Identifier: MIT
// World: texts as they stand in scenario files.
#include "ftcs/experiment/quantity.h"

#include <gtest/gtest.h>

namespace ftcs::experiment {
namespace {

TEST(Quantity, reads_times_with_their_unit) {
  EXPECT_EQ(parse_duration("100 us")->ns(), 100'000.0);
  EXPECT_EQ(parse_duration("-21us")->ns(), -21'000.0);
  EXPECT_EQ(parse_duration("51.5 ns")->ns(), 51.5);
  EXPECT_EQ(parse_duration("2 min")->ns(), 120e9);
  EXPECT_EQ(parse_duration("0")->ns(), 0.0);
}

TEST(Quantity, refuses_times_without_a_unit_or_with_a_wrong_one) {
  for (const char* text :
       {"", "5", "ns", "5 ppm", "5 usec", "5 us 3", "nan ns", "1e999 s", "--5 s"}) {
    EXPECT_FALSE(parse_duration(text)) << text;
  }
}

TEST(Quantity, reads_fractions) {
  EXPECT_DOUBLE_EQ(*parse_ratio("50 ppm"), 50e-6);
  EXPECT_DOUBLE_EQ(*parse_ratio("-7.4 %"), -0.074);
  EXPECT_DOUBLE_EQ(*parse_ratio("1e-9"), 1e-9);
  EXPECT_FALSE(parse_ratio("50 us"));
}

TEST(Quantity, reads_drifts_and_random_walks) {
  EXPECT_DOUBLE_EQ(*parse_ratio_per_second("86400 ppb/d"), 1e-9);
  EXPECT_DOUBLE_EQ(*parse_ratio_per_second("1 ppm/s"), 1e-6);
  EXPECT_DOUBLE_EQ(*parse_ratio_per_root_second("1e-9 /sqrt(s)"), 1e-9);
  EXPECT_FALSE(parse_ratio_per_second("1 ppm"));
  EXPECT_FALSE(parse_ratio_per_root_second("1e-9"));
}

}  // namespace
}  // namespace ftcs::experiment
