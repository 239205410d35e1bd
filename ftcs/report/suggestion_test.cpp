// SPDX-License-Identifier: MIT
#include "ftcs/report/suggestion.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

TEST(Suggestion, is_what_was_begun_or_what_is_two_letters_away) {
  const std::vector<std::string> names{"--clock",          "--clock_servo", "--domainNumber",
                                       "--step_threshold", "--csv",         "-s"};
  EXPECT_EQ(suggestion("--domain", names), "--domainNumber");
  EXPECT_EQ(suggestion("--DomainNumbr", names), "--domainNumber");
  EXPECT_EQ(suggestion("--step-threshold", names), "--step_threshold");
  EXPECT_EQ(suggestion("--clok", names), "--clock");
  EXPECT_EQ(suggestion("--clock", names), "--clock");
  EXPECT_EQ(suggestion("--colour", names), "");
  EXPECT_EQ(suggestion("--cs", names), "") << "too short to tell";
  EXPECT_EQ(suggestion("-x", names), "");
  EXPECT_EQ(suggestion("", {}), "");
}

}  // namespace
}  // namespace ftcs
