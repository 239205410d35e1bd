// SPDX-License-Identifier: MIT
// World: two messages forward and one back in each cycle (a Sync and the two peer delay messages
// where the neighbour is the transmitter), noise normal of 100 ns; the clock is 1 ppm slower from
// one moment on. Or a message of each direction in each cycle, a third of them at the floor with
// noise of 20 ns, the others 15 us late, exponential; filters that follow a line 10 us off.
#include "ftcs/estimation/floor_search.h"

#include <algorithm>
#include <cstddef>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

/// Whether a floor is found before or after the step of the rate.
bool finds_a_floor(std::uint64_t seed, double changed_at) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 100.0);
  FloorSearch search;
  double time = 0.0;
  for (std::size_t k = 0; k < 360; ++k) {
    const Direction direction = k % 3 == 1 ? Direction::kBackward : Direction::kForward;
    time += 1.0 / 3.0;
    const double x = 5e4 * time - 1000.0 * std::max(0.0, time - changed_at);
    const double z = x + sign_of(direction) * (10e3 + normal(random));
    search.hear({direction, z, 0.0, false, time < changed_at ? 5e4 : 4.9e4}, 1.0 / 3.0);
    if (search.look({}, 0.4)) return true;
  }
  return false;
}

// With windows of as many messages of either direction, twice as long back as forward: 40 of 40.
TEST(FloorSearch, a_rate_that_has_changed_is_no_floor_where_one_direction_speaks_twice_as_often) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) found += finds_a_floor(seed, 20.0) ? 1 : 0;
  EXPECT_EQ(found, 0);
}

/// Whether the floor is found beside a line that is followed already.
bool finds_another(FloorSearch::Rival rival, bool alarm, double floor_ns = 10e3) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, 20.0);
  std::exponential_distribution<double> wait(1.0 / 15e3);
  std::bernoulli_distribution waits(2.0 / 3.0);
  FloorSearch search;
  for (std::size_t k = 0; k < 200; ++k) {
    for (const Direction direction : kDirections) {
      const double delay = floor_ns + normal(random) + (waits(random) ? wait(random) : 0.0);
      search.hear({direction, sign_of(direction) * delay, -12.0, false, 0.0}, 0.5);
      if (alarm) search.alarm();
      if (search.look(rival, 0.4)) return true;
    }
  }
  return false;
}

TEST(FloorSearch, a_floor_that_was_only_begun_does_not_end_the_search) {
  FloorSearch::Rival rival{true, false, false, 10e3, 500.0, 0.0};
  rival.noise = 20.0;
  rival.share = {0.3, 0.3};
  EXPECT_TRUE(finds_another(rival, false));
  rival.found = true;
  EXPECT_FALSE(finds_another(rival, false));
  EXPECT_TRUE(finds_another(rival, true));
}

// What was recorded before a step and after it makes floors at which messages arrive before they
// were sent.
TEST(FloorSearch, a_delay_below_what_is_possible_is_no_floor) {
  FloorSearch::Rival rival{true, true, false, 10e3, 500.0, 0.0, -1e3, 20.0, {0.3, 0.3}};
  EXPECT_TRUE(finds_another(rival, true, 10e3));
  EXPECT_TRUE(finds_another(rival, true, -0.9e3));
  EXPECT_FALSE(finds_another(rival, true, -10e3));
  rival.least_delay = FloorSearch::Rival{}.least_delay;  // it was below zero before
  EXPECT_TRUE(finds_another(rival, true, -10e3));
}

}  // namespace
}  // namespace ftcs::estimation
