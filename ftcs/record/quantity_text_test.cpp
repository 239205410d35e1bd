// SPDX-License-Identifier: MIT
// World: what people type.
#include "ftcs/record/quantity_text.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

TEST(Units, durations_carry_their_unit) {
  EXPECT_EQ(*parse_duration("1ms"), Duration::from_whole_ns(1'000'000));
  EXPECT_EQ(*parse_duration("-2.5us"), Duration::from_whole_ns(-2'500));
  EXPECT_EQ(*parse_duration("+3s"), Duration::from_whole_ns(3'000'000'000));
  EXPECT_EQ(*parse_duration("0.25ns"), Duration::from_ns(0.25));
  EXPECT_EQ(*parse_duration("1e3ns"), Duration::from_whole_ns(1'000));
  EXPECT_EQ(*parse_duration("0"), Duration{});
}

TEST(Units, a_time_without_unit_or_with_rubbish_is_an_error_that_quotes_it) {
  for (const char* text :
       {"", "1", "ms", "1 ms", "1min", "nans", "infs", "1e30s", "0x10ns", "--1s"}) {
    const auto parsed = parse_duration(text);
    ASSERT_FALSE(parsed.ok()) << text;
    EXPECT_NE(parsed.error().message.find(text), std::string::npos);
  }
}

TEST(Units, rates_are_deviations_below_standstill) {
  EXPECT_DOUBLE_EQ(*parse_ppb("50ppm"), 50'000.0);
  EXPECT_DOUBLE_EQ(*parse_ppb("-3ppb"), -3.0);
  EXPECT_FALSE(parse_ppb("50").ok());
  EXPECT_FALSE(parse_ppb("1000000ppm").ok());
}

TEST(Units, a_band_is_one_or_two_ordered_durations) {
  EXPECT_EQ(parse_band("1us")->leave, Duration::from_whole_ns(1'000));
  EXPECT_EQ(parse_band("1us:5us")->enter, Duration::from_whole_ns(1'000));
  EXPECT_EQ(parse_band("1us:5us")->leave, Duration::from_whole_ns(5'000));
  for (const char* text : {"5us:1us", "-1us", "1us:", ":1us", "1us:2us:3us"}) {
    EXPECT_FALSE(parse_band(text).ok()) << text;
  }
}

TEST(Units, numbers_keep_within_their_range) {
  EXPECT_EQ(*parse_integer("0xFE", 0, 255), 254);
  EXPECT_EQ(*parse_integer("-7", -7, 7), -7);
  for (const char* text : {"", "8", "-8", "1.5", "1x", "0x", "99999999999999999999"}) {
    EXPECT_FALSE(parse_integer(text, -7, 7).ok()) << text;
  }
  EXPECT_DOUBLE_EQ(*parse_number("0.00002", 0, 1), 2e-5);
  EXPECT_FALSE(parse_number("nan", -1, 1).ok());
  EXPECT_FALSE(parse_number("0.5s", 0, 1).ok());
}

}  // namespace
}  // namespace ftcs
