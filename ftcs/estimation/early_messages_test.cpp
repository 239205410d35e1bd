// SPDX-License-Identifier: MIT
#include "ftcs/estimation/early_messages.h"

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

constexpr Direction kForward = Direction::kForward;
constexpr Direction kBackward = Direction::kBackward;
using enum EarlyMessages::Message;

TEST(EarlyMessages, at_first_no_single_message_changes_the_rate) {
  EXPECT_FALSE(EarlyMessages{}.one_suffices());
}

TEST(EarlyMessages, one_suffices_once_changes_have_proved_to_be_the_rule) {
  EarlyMessages early;
  for (int change = 0; change < 2; ++change) {
    EXPECT_FALSE(early.observe(kForward, kEarly));
    early.changed(false);
  }
  EXPECT_TRUE(early.one_suffices());
  EXPECT_EQ(early.probability(kForward), 1e-5);
}

TEST(EarlyMessages, one_that_the_next_of_its_direction_does_not_bear_out_was_an_outlier) {
  EarlyMessages early;
  EXPECT_FALSE(early.observe(kForward, kEarly));
  EXPECT_FALSE(early.observe(kBackward, kFits));  // says nothing of the forward one
  EXPECT_TRUE(early.observe(kForward, kFits));
  EXPECT_GT(early.probability(kForward), 1e-3);
  EXPECT_EQ(early.probability(kBackward), 1e-5);
}

TEST(EarlyMessages, an_outlier_takes_the_trust_that_changes_have_earned) {
  EarlyMessages early;
  for (int change = 0; change < 2; ++change) {
    (void)early.observe(kForward, kEarly);
    early.changed(false);
  }
  (void)early.observe(kForward, kEarly);
  (void)early.observe(kForward, kFits);
  EXPECT_FALSE(early.one_suffices());
}

TEST(EarlyMessages, a_change_for_one_message_that_the_next_refutes_was_an_outlier) {
  EarlyMessages early;
  (void)early.observe(kForward, kEarly);
  early.changed(true);
  (void)early.observe(kBackward, kNeither);
  EXPECT_GT(early.probability(kBackward) + early.probability(kForward), 1e-3);
}

TEST(EarlyMessages, a_late_one_of_the_same_direction_or_an_early_one_of_the_other_contradicts) {
  EarlyMessages early;
  (void)early.observe(kForward, kEarly);
  EXPECT_TRUE(early.contradicted_by(kForward, false));
  EXPECT_FALSE(early.contradicted_by(kForward, true));
  EXPECT_TRUE(early.contradicted_by(kBackward, true));
  EXPECT_FALSE(early.contradicted_by(kBackward, false));
}

TEST(EarlyMessages, a_second_one_says_the_same_if_a_clock_can_have_brought_both) {
  EarlyMessages messages;
  (void)messages.observe(kForward, kLate);
  EXPECT_TRUE(messages.seconded_by(kForward, false));
  EXPECT_TRUE(messages.seconded_by(kBackward, true));
  EXPECT_FALSE(messages.seconded_by(kBackward, false)) << "a host that stands still";
  EXPECT_TRUE(messages.observe(kForward, kFits)) << "what it said is void";
  EXPECT_FALSE(messages.seconded_by(kForward, false));
  EXPECT_EQ(messages.probability(kForward), 1e-5) << "late ones are no early ones";
}

TEST(EarlyMessages, what_is_long_past_is_forgotten) {
  EarlyMessages early;
  (void)early.observe(kForward, kEarly);
  (void)early.observe(kForward, kFits);
  const double before = early.probability(kForward);
  for (int k = 0; k < 10'000; ++k) (void)early.observe(kForward, kFits);
  EXPECT_LT(early.probability(kForward), before / 20.0);
}

}  // namespace
}  // namespace ftcs::estimation
