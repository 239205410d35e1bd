// SPDX-License-Identifier: MIT
#include "ftcs/estimation/early_messages.h"

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

constexpr Direction kForward = Direction::kForward;
constexpr Direction kBackward = Direction::kBackward;
constexpr bool kFar = true;
constexpr bool kFits = true;

TEST(EarlyMessages, at_first_no_single_message_changes_the_rate) {
  EXPECT_FALSE(EarlyMessages{}.one_suffices());
}

TEST(EarlyMessages, one_suffices_once_changes_have_proved_to_be_the_rule) {
  EarlyMessages early;
  for (int change = 0; change < 2; ++change) {
    EXPECT_FALSE(early.observe(kForward, kFar, !kFits));
    early.changed(false);
  }
  EXPECT_TRUE(early.one_suffices());
  EXPECT_EQ(early.probability(kForward), 1e-5);
}

TEST(EarlyMessages, one_that_the_next_of_its_direction_does_not_bear_out_was_an_outlier) {
  EarlyMessages early;
  EXPECT_FALSE(early.observe(kForward, kFar, !kFits));
  EXPECT_FALSE(early.observe(kBackward, !kFar, kFits));  // says nothing of the forward one
  EXPECT_TRUE(early.observe(kForward, !kFar, kFits));
  EXPECT_GT(early.probability(kForward), 1e-3);
  EXPECT_EQ(early.probability(kBackward), 1e-5);
}

TEST(EarlyMessages, an_outlier_takes_the_trust_that_changes_have_earned) {
  EarlyMessages early;
  for (int change = 0; change < 2; ++change) {
    (void)early.observe(kForward, kFar, !kFits);
    early.changed(false);
  }
  (void)early.observe(kForward, kFar, !kFits);
  (void)early.observe(kForward, !kFar, kFits);
  EXPECT_FALSE(early.one_suffices());
}

TEST(EarlyMessages, a_change_for_one_message_that_the_next_refutes_was_an_outlier) {
  EarlyMessages early;
  (void)early.observe(kForward, kFar, !kFits);
  early.changed(true);
  (void)early.observe(kBackward, !kFar, !kFits);
  EXPECT_GT(early.probability(kBackward) + early.probability(kForward), 1e-3);
}

TEST(EarlyMessages, a_late_one_of_the_same_direction_or_an_early_one_of_the_other_contradicts) {
  EarlyMessages early;
  (void)early.observe(kForward, kFar, !kFits);
  EXPECT_TRUE(early.contradicted_by(kForward, false));
  EXPECT_FALSE(early.contradicted_by(kForward, true));
  EXPECT_TRUE(early.contradicted_by(kBackward, true));
  EXPECT_FALSE(early.contradicted_by(kBackward, false));
}

TEST(EarlyMessages, what_is_long_past_is_forgotten) {
  EarlyMessages early;
  (void)early.observe(kForward, kFar, !kFits);
  (void)early.observe(kForward, !kFar, kFits);
  const double before = early.probability(kForward);
  for (int k = 0; k < 10'000; ++k) (void)early.observe(kForward, !kFar, kFits);
  EXPECT_LT(early.probability(kForward), before / 20.0);
}

}  // namespace
}  // namespace ftcs::estimation
