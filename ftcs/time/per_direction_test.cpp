// SPDX-License-Identifier: MIT
#include "ftcs/time/per_direction.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

TEST(PerDirection, keeps_the_values_of_the_two_directions_apart) {
  PerDirection<int> value{1, 2};
  value[Direction::kForward] += 10;
  value[Direction::kBackward] += 20;
  EXPECT_EQ(value.forward, 11);
  EXPECT_EQ(value.backward, 22);
}

TEST(PerDirection, the_opposite_direction_has_the_opposite_sign) {
  for (const Direction direction : kDirections) {
    EXPECT_NE(opposite(direction), direction);
    EXPECT_EQ(sign_of(opposite(direction)), -sign_of(direction));
  }
  EXPECT_EQ(sign_of(Direction::kForward), 1.0);
}

}  // namespace
}  // namespace ftcs
