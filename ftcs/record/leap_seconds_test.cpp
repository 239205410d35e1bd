// SPDX-License-Identifier: MIT
#include "ftcs/record/leap_seconds.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

// The last three lines of the published list, and an invented leap second that is left out.
constexpr const char* kList =
    "#$ 3676924800\n"
    "#@ 3928521600\n"
    "# a comment\n"
    "3550089600\t35\t# 1 Jul 2012\n"
    "3644697600\t36\t# 1 Jul 2015\n"
    "3692217600\t37\t# 1 Jan 2017\n"
    "3786825600\t36\t# 1 Jan 2020\n"
    "#h 1 2 3 4 5\n";
constexpr std::int64_t kNewYear2017 = 1'483'228'800;
constexpr std::int64_t kNewYear2020 = 1'577'836'800;

TEST(LeapSeconds, tells_the_offset_and_the_leap_at_the_end_of_the_day) {
  const auto list = LeapSeconds::parse(kList, "list");
  ASSERT_TRUE(list.ok()) << list.error();
  EXPECT_FALSE(list->at(0).has_value());
  const auto check = [&](std::int64_t when, int offset, int leap) {
    const auto state = list->at(when);
    ASSERT_TRUE(state.has_value());
    EXPECT_EQ(state->utc_offset, offset) << when;
    EXPECT_EQ(state->leap, leap) << when;
  };
  check(kNewYear2017 - 86'401, 36, 0);
  check(kNewYear2017 - 86'400, 36, 1);
  check(kNewYear2017 - 1, 36, 1);
  check(kNewYear2017, 37, 0);
  check(kNewYear2020 - 1, 37, -1);
  check(kNewYear2020, 36, 0);
  EXPECT_EQ(list->expires(), 3'928'521'600 - 2'208'988'800);
}

TEST(LeapSeconds, names_the_line_that_is_wrong) {
  EXPECT_EQ(LeapSeconds::parse("# x\nabc 37\n", "f").error(),
            "f:2: expected seconds since 1900 and TAI-UTC");
  EXPECT_NE(LeapSeconds::parse("3550089600\n", "f").error().find("f:1:"), std::string::npos);
  EXPECT_NE(
      LeapSeconds::parse("3550089600 35\n3550089600 36\n", "f").error().find("f:2: not later"),
      std::string::npos);
  EXPECT_EQ(LeapSeconds::parse("# only talk\n", "f").error(), "f: holds no leap seconds");
  EXPECT_NE(LeapSeconds::read_file("/no/such/file").error().find("No such file"),
            std::string::npos);
}

}  // namespace
}  // namespace ftcs
