// SPDX-License-Identifier: MIT
// World: delays of one link, as exchanges of peer delay messages tell them, one by one.
#include "ftcs/measurement/link_delay.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

TEST(LinkDelay, is_the_median_of_what_was_measured) {
  LinkDelay delay({});
  EXPECT_FALSE(delay.known());
  for (const Nanoseconds value : {500ns, 9'000ns, 510ns}) EXPECT_TRUE(delay.add(value, false));
  EXPECT_EQ(delay.value(), Duration{510ns});
}

TEST(LinkDelay, leaves_out_what_no_link_can_have) {
  LinkDelay delay({});
  EXPECT_FALSE(delay.add(-1'001ns, true));
  EXPECT_FALSE(delay.add(100'000'001ns, false));
  EXPECT_FALSE(delay.known());
  EXPECT_TRUE(delay.add(-1'000ns, false));  // noise on a short link
  EXPECT_EQ(delay.value(), Duration{-1'000ns});
}

TEST(LinkDelay, begins_anew_with_another_link) {
  LinkDelay delay({});
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(delay.add(5'000ns, i == 0));
  EXPECT_TRUE(delay.add(300ns, true));
  EXPECT_EQ(delay.value(), Duration{300ns});
}

}  // namespace
}  // namespace ftcs
