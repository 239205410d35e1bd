// SPDX-License-Identifier: MIT
// World: innovations by hand; noise of 45 ns, lucky messages 16.13 us early.
#include "ftcs/estimation/lucky_level.h"

#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

constexpr double kNoise = 45.0;
constexpr double kLucky = 16'130.0;

/// Both directions, one after the other; one of so many is lucky (0: none). Messages until found.
struct World {
  int forward_every;
  int backward_every;
  double spread_ns = kNoise;

  [[nodiscard]] int found_after(int messages) const {
    LuckyLevel level;
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal(0.0, spread_ns);
    for (int i = 1; i <= messages; ++i) {
      for (const Direction direction : kDirections) {
        const int every = direction == Direction::kForward ? forward_every : backward_every;
        const bool lucky = every > 0 && i % every == 0;
        level.observe(direction, !lucky, lucky ? kLucky + normal(random) : normal(random), kNoise);
      }
      if (level.found(Direction::kForward) || level.found(Direction::kBackward)) return i;
    }
    return 0;
  }
};

TEST(LuckyLevel, is_found_in_either_direction_once_the_other_is_clear) {
  EXPECT_EQ((World{20, 0}.found_after(2'000)), 180);
  EXPECT_EQ((World{0, 20}.found_after(2'000)), 180);
  EXPECT_GT((World{40, 0}.found_after(2'000)), 240);
}

TEST(LuckyLevel, of_both_directions_moves_nothing) {
  EXPECT_EQ((World{20, 20}.found_after(9'000)), 0);
}

TEST(LuckyLevel, what_is_rarer_or_of_any_size_is_an_outlier) {
  EXPECT_EQ((World{60, 0}.found_after(9'000)), 0);
  EXPECT_EQ((World{20, 0, 2'000.0}.found_after(9'000)), 0);
}

// Outliers all of one size, one of 300 of each direction: six close together were a level in 4 runs
// of 1,000.
TEST(LuckyLevel, outliers_of_one_size_that_come_close_together_by_chance_are_none) {
  std::mt19937_64 random(1);
  std::bernoulli_distribution outlier(1.0 / 300.0);
  int found = 0;
  for (int run = 0; run < 1000; ++run) {
    LuckyLevel level;
    bool here = false;
    for (int i = 0; i < 4800 && !here; ++i) {
      for (const Direction direction : kDirections) {
        const bool early = outlier(random);
        level.observe(direction, !early, early ? 1600.0 : 0.0, kNoise);
        here = here || level.found(direction);
      }
    }
    found += here ? 1 : 0;
  }
  EXPECT_EQ(found, 0);
}

TEST(LuckyLevel, a_path_that_has_become_shorter_is_no_level) {
  EXPECT_EQ((World{1, 0}.found_after(9'000)), 0);
}

TEST(LuckyLevel, of_both_directions_alike_is_told_from_one_that_differs) {
  const auto alike = [](double backward) {
    LuckyLevel level;
    for (int i = 1; i <= 60; ++i) {
      const bool lucky = i % 20 == 0;
      level.observe(Direction::kForward, !lucky, lucky ? kLucky : 0.0, kNoise);
      level.observe(Direction::kBackward, !lucky, lucky ? backward : 0.0, kNoise);
    }
    return level.alike(kNoise);
  };
  EXPECT_TRUE(alike(kLucky + kNoise));
  EXPECT_FALSE(alike(kLucky + 10.0 * kNoise));
  EXPECT_FALSE(alike(-kLucky)) << "late";
}

/// Backward one of twenty messages is lucky.
LuckyLevel one_in_twenty() {
  LuckyLevel level;
  for (int i = 1; i <= 400; ++i) {
    level.observe(Direction::kBackward, i % 20 != 0, i % 20 == 0 ? kLucky : 0.0, kNoise);
    level.observe(Direction::kForward, true, 0.0, kNoise);
  }
  return level;
}

TEST(LuckyLevel, tells_where_it_is_and_how_many_reach_it) {
  const LuckyLevel level = one_in_twenty();
  ASSERT_TRUE(level.found(Direction::kBackward));
  EXPECT_FALSE(level.found(Direction::kForward));
  EXPECT_NEAR(level.ns(Direction::kBackward), kLucky, 0.01);
  EXPECT_NEAR(level.share(Direction::kBackward), 0.05, 0.01);
}

}  // namespace
}  // namespace ftcs::estimation
