// SPDX-License-Identifier: MIT
// World: messages of both directions at x + y t + sign d, a part of them later by known waits.
#include "ftcs/estimation/touching_lines.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

struct Message {
  double time;  ///< cycles
  double wait;  ///< ns
};

PerDirection<FloorMessages> read(const std::vector<Message>& of_each, double rate) {
  LongestRecord record;
  double now = 0.0;
  for (const Message& m : of_each) {
    record.elapse(m.time - now);
    now = m.time;
    for (const Direction direction : kDirections) {
      const double z = 5000.0 + rate * now + sign_of(direction) * (10e3 + m.wait);
      (void)record.push({direction, z, 0.0, false, 0.0});
    }
  }
  PerDirection<FloorMessages> out;
  for (const Direction direction : kDirections) {
    const RecordWindow window = record.window(direction, LongestRecord::kCapacity);
    out[direction].read(direction, window, 5000.0 + rate * now);
  }
  return out;
}

TEST(TouchingLines, have_the_rate_of_messages_that_wait_for_nothing) {
  for (const double rate : {-6250.0, 0.0, 6250.0}) {
    std::vector<Message> all;
    for (int k = 0; k < 24; ++k) all.push_back({k + 0.25, k % 3 == 1 ? 0.0 : 1e4 + 900.0 * k});
    const auto messages = read(all, rate);
    const TouchingLines lines = best_touching_lines(messages, 1.0);
    EXPECT_NEAR(lines.rate, rate, 1e-6);
    EXPECT_LE(lines.width, 2.0);
    EXPECT_GT(lines.width, 0.0);
    EXPECT_NEAR(lines.floor.forward, 10e3, 1e-3);
    EXPECT_NEAR(lines.floor.backward, 10e3, 1e-3);
    EXPECT_NEAR(lines.mean, 2.0 / 3.0 * (1e4 + 900.0 * 11.75), 500.0);
  }
}

/// Whatever was heard, even several at one time, lies above both, and one of each on them.
TEST(TouchingLines, touch_from_below) {
  std::mt19937_64 random(1);
  std::exponential_distribution<double> wait(1e-4);
  for (const int size : {2, 6, 7, 128}) {
    for (int round = 0; round < 50; ++round) {
      std::vector<Message> all;
      for (int k = 0; k < size; ++k)
        all.push_back({static_cast<double>((k + 1) / (round % 2 + 1)), wait(random)});
      const auto messages = read(all, 100.0);
      const TouchingLines lines = best_touching_lines(messages, 1.0);
      if (!(lines.width > 0.0)) continue;
      for (const Direction direction : kDirections) {
        double least = 1e300;
        for (std::size_t k = 0; k < messages[direction].size; ++k) {
          least = std::min(least, messages[direction].height(k, lines.rate));
        }
        EXPECT_NEAR(lines.floor[direction], least, 1e-6);
      }
    }
  }
}

TEST(TouchingLines, are_none_without_two_moments_or_six_messages) {
  EXPECT_EQ(best_touching_lines(read(std::vector<Message>(20, {1.0, 0.0}), 0.0), 1.0).width, 0.0);
  EXPECT_EQ(best_touching_lines(read({{1.0, 0.0}, {2.0, 0.0}}, 0.0), 1.0).width, 0.0);
  EXPECT_GT(best_touching_lines(read({{1.0, 0.0}, {2.0, 0.0}, {3.0, 0.0}}, 0.0), 1.0).width, 0.0);
}

}  // namespace
}  // namespace ftcs::estimation
