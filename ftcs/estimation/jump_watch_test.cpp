// SPDX-License-Identifier: MIT
#include "ftcs/estimation/jump_watch.h"

#include <cmath>

#include <gtest/gtest.h>

#include "ftcs/estimation/lateness.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::estimation {
namespace {

using Verdict = JumpWatch::Verdict;

/// A calm filter that knows offset 0, rate 0 and a path of 10 us, with 100 ns
/// of noise; it takes everything far off for an outlier and keeps its opinion.
class Calm {
 public:
  explicit Calm(bool two_way = true) : two_way_(two_way) {}
  /// A message `elapsed` cycles after the last one, `z` = x + sign (d + n).
  Verdict message(Direction direction, double elapsed, double z, double rival = 0.0) {
    JumpMessage message;
    message.seen = {direction == Direction::kForward ? 1.0 : -1.0, elapsed, z};
    message.scale = 100.0;
    message.outliers = {0.03, 1e-5};
    message.two_way = message.delay_free = two_way_;
    message.believed = believed_;
    const double nu = message.seen.sign * (z - believed_.x) - believed_.d;
    const double variance = 1e4 * (1.0 + believed_.xx + believed_.dd);
    message.distance = nu * nu / variance;
    const Score normal = normal_score(nu, variance);
    const double outlier = (nu > 0.0 ? 0.03 : 1e-5) / (10.0 * std::abs(nu) + 1.0);
    message.log_density = std::log(std::exp(normal.log_density) + outlier);
    watch_.follow(message);
    return watch_.judge(rival);
  }
  Verdict forward(double elapsed, double z) { return message(Direction::kForward, elapsed, z); }
  Verdict backward(double elapsed, double z) { return message(Direction::kBackward, elapsed, z); }
  [[nodiscard]] const JumpWatch& watch() const { return watch_; }

 private:
  Estimate believed_{0.0, 0.0, 10'000.0, 0.01, 0.0, 0.0, 1e-8, 0.0, 0.01};
  JumpWatch watch_;
  bool two_way_;
};

constexpr double kPath = 10'000.0;

TEST(JumpWatch, has_nothing_to_say_of_noise) {
  Calm calm;
  EXPECT_EQ(calm.forward(0.5, kPath + 150.0), Verdict::kNothing);
  EXPECT_EQ(calm.backward(0.5, -kPath - 250.0), Verdict::kNothing);
}

TEST(JumpWatch, finds_a_jump_of_the_offset_with_one_message_of_each_direction) {
  Calm calm;
  EXPECT_NE(calm.forward(0.7, kPath - 20'000.0), Verdict::kJumped);
  EXPECT_EQ(calm.backward(0.3, -kPath - 20'060.0), Verdict::kJumped);
  const Estimate jumped = calm.watch().estimate();
  EXPECT_NEAR(jumped.x, -20'000.0, 100.0);
  EXPECT_NEAR(jumped.y, 0.0, 1.0);  // the rate is known as before
  EXPECT_NEAR(jumped.d, kPath, 10.0);
}

TEST(JumpWatch, finds_a_jump_of_any_size) {
  for (const double jump : {1e6, 1e7, 5e7, 2e9, -37e9}) {
    Calm calm;
    EXPECT_NE(calm.forward(0.7, kPath + jump), Verdict::kJumped);
    EXPECT_EQ(calm.backward(0.3, -kPath + jump - 60.0), Verdict::kJumped) << jump;
    EXPECT_NEAR(calm.watch().estimate().x, jump, 100.0);
    EXPECT_NEAR(calm.watch().estimate().d, kPath, 10.0);
  }
}

TEST(JumpWatch, needs_both_directions) {
  Calm calm;
  for (int i = 0; i < 4; ++i) EXPECT_NE(calm.forward(1.0, kPath - 20'000.0), Verdict::kJumped) << i;
  EXPECT_EQ(calm.backward(0.1, -kPath - 20'000.0), Verdict::kJumped);
}

TEST(JumpWatch, asks_more_of_one_direction_where_there_is_no_other) {
  Calm calm(false);
  EXPECT_NE(calm.forward(1.0, kPath + 20'000.0), Verdict::kJumped);
  EXPECT_NE(calm.forward(1.0, kPath + 20'000.0), Verdict::kJumped);
  Verdict last = Verdict::kNothing;
  for (int i = 0; i < 4 && last != Verdict::kJumped; ++i)
    last = calm.forward(1.0, kPath + 20'000.0);
  EXPECT_EQ(last, Verdict::kJumped);
}

TEST(JumpWatch, waits_for_certainty_of_a_longer_path_and_leaves_the_offset_alone) {
  Calm calm;
  EXPECT_NE(calm.forward(0.5, kPath + 15'000.0), Verdict::kJumped);
  EXPECT_EQ(calm.backward(0.5, -kPath - 15'000.0), Verdict::kWait);
  EXPECT_NE(calm.forward(0.5, kPath + 15'000.0), Verdict::kJumped);
  EXPECT_NE(calm.backward(0.5, -kPath - 15'000.0), Verdict::kNothing);
  Verdict last = Verdict::kNothing;
  for (int i = 0; i < 2 && last != Verdict::kJumped; ++i)
    last = calm.forward(0.5, kPath + 15'000.0);
  EXPECT_EQ(last, Verdict::kJumped);
  EXPECT_NEAR(calm.watch().estimate().x, 0.0, 30.0);
  EXPECT_NEAR(calm.watch().estimate().d, kPath + 15'000.0, 150.0);
}

/// A message of each direction that is early, the first of them by chance, speaks for a shorter
/// path; that the clock has jumped by as much is told by one direction alone.
TEST(JumpWatch, what_spoke_for_the_delay_before_does_not_decide_against_the_offset) {
  Calm calm;
  EXPECT_NE(calm.backward(0.5, -kPath + 10'000.0), Verdict::kJumped);
  Verdict last = Verdict::kNothing;
  for (int i = 0; i < 6 && last != Verdict::kJumped; ++i) {
    const double offset = -10'000.0;
    last = calm.forward(0.5, kPath + offset);
    if (last != Verdict::kJumped) last = calm.backward(0.5, -kPath + offset);
  }
  EXPECT_EQ(last, Verdict::kJumped);
  EXPECT_NEAR(calm.watch().estimate().x, -10'000.0, 150.0);
  EXPECT_NEAR(calm.watch().estimate().d, kPath, 150.0);
}

TEST(JumpWatch, forgets_an_outlier) {
  Calm calm;
  (void)calm.forward(0.5, kPath + 100'000.0);
  EXPECT_EQ(calm.backward(0.5, -kPath), Verdict::kNothing);
  EXPECT_EQ(calm.forward(0.5, kPath), Verdict::kNothing);
}

TEST(Lateness, late_in_both_directions_is_no_clock) {
  Lateness lateness;
  lateness.observe(0, true, 100.0);
  EXPECT_TRUE(lateness.speaks_of_clock());
  lateness.observe(1, true, 100.0);
  EXPECT_FALSE(lateness.speaks_of_clock());
  lateness.observe(1, false, 100.0);
  EXPECT_TRUE(lateness.speaks_of_clock());
}

TEST(Lateness, is_forgotten_after_eight_messages) {
  Lateness lateness;
  lateness.observe(0, true, 100.0);
  lateness.observe(1, true, 100.0);
  for (int i = 0; i < 8; ++i) lateness.observe(0, true, 1.0);
  EXPECT_TRUE(lateness.speaks_of_clock());
}

}  // namespace
}  // namespace ftcs::estimation
