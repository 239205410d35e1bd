// SPDX-License-Identifier: MIT
// World: lines as counters, spreadsheets and scripts write them.
#include "ftcs/record/fields.h"

#include <gtest/gtest.h>

#include "ftcs/record/units.h"

namespace ftcs {
namespace {

using Views = std::vector<std::string_view>;

TEST(Fields, are_separated_by_comma_semicolon_or_space) {
  EXPECT_EQ(split_fields("1, 2 ,3", separator_of("1, 2 ,3")), (Views{"1", "2", "3"}));
  EXPECT_EQ(split_fields("1;;3", separator_of("1;;3")), (Views{"1", "", "3"}));
  EXPECT_EQ(split_fields("  1 \t 2  ", separator_of("1 \t 2")), (Views{"1", "2"}));
  EXPECT_EQ(split_fields("\"a\",\" b \"", ','), (Views{"a", "b"}));
}

TEST(Fields, are_numbers_only_as_a_whole_and_only_when_finite) {
  EXPECT_EQ(parse_decimal("-1.5e-9"), -1.5e-9);
  EXPECT_EQ(parse_decimal("+3"), 3.0);
  for (const char* text : {"", "+", "+-3", "1.5x", "inf", "nan", "0x10", "1,5", "1e999"}) {
    EXPECT_FALSE(parse_decimal(text).has_value()) << text;
  }
}

TEST(Fields, that_say_missing_are_known) {
  for (const char* text : {"", "-", "NaN", "NA", "null"}) EXPECT_TRUE(is_missing(text)) << text;
  EXPECT_FALSE(is_missing("none of these"));
}

TEST(Units, are_read_from_the_end_of_a_heading) {
  EXPECT_EQ(unit_in_heading("offset_ns"), "ns");
  EXPECT_EQ(unit_in_heading("offset (ns)"), "ns");
  EXPECT_EQ(unit_in_heading("rate / ppb"), "ppb");
  EXPECT_EQ(unit_in_heading("time_s"), "s");
  EXPECT_EQ(unit_in_heading("offset"), "");
  EXPECT_EQ(unit_in_heading("s"), "");
  EXPECT_EQ(unit_in_heading("column 1"), "");
  EXPECT_EQ(unit_in_heading(""), "");
}

}  // namespace
}  // namespace ftcs
