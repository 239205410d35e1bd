// SPDX-License-Identifier: MIT
// World: messages of two directions that are believed (credit 1) or not (credit
// 0), late unless said otherwise.
#include "ftcs/estimation/gate.h"

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

using Verdict = Gate::Verdict;
constexpr std::uint32_t kLongAgo = 5000;

/// A path on which every message of both directions was believed so far.
Gate clean_path() {
  Gate gate;
  for (int i = 0; i < 400; ++i) {
    for (const std::size_t side : {0U, 1U}) {
      gate.learn(side, 1.0);
      EXPECT_EQ(gate.observe(side, 1.0, false, kLongAgo), Verdict::kShut);
    }
  }
  return gate;
}
Verdict reject(Gate& gate, std::size_t side, bool early = false,
               std::uint32_t since_change = kLongAgo) {
  gate.learn(side, 0.0);
  return gate.observe(side, 0.0, early, since_change);
}

TEST(Gate, opens_at_the_eighth_message_and_hears_it_once_more_where_the_other_direction_fits) {
  Gate gate = clean_path();
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(reject(gate, 0), Verdict::kShut);
    EXPECT_EQ(gate.observe(1, 1.0, false, kLongAgo), Verdict::kShut);
  }
  EXPECT_EQ(reject(gate, 0), Verdict::kOpenAlone);
  EXPECT_EQ(reject(gate, 0), Verdict::kShut) << "counts anew";
}

TEST(Gate, opens_at_the_sixth_where_a_change_has_just_been_followed) {
  Gate gate = clean_path();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(reject(gate, 0, false, 10), Verdict::kShut) << i;
  EXPECT_EQ(reject(gate, 0, false, 10), Verdict::kOpenAlone);
}

TEST(Gate, waits_for_eight_where_both_are_late_too_and_hears_none_again) {
  Gate gate = clean_path();
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(reject(gate, 0), Verdict::kShut);
    EXPECT_EQ(reject(gate, 1), Verdict::kShut);
  }
  EXPECT_EQ(reject(gate, 0), Verdict::kOpen);
}

TEST(Gate, opens_when_more_are_refused_than_were_ever_taken) {
  Gate gate;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(reject(gate, 0), Verdict::kShut) << i;
  EXPECT_EQ(reject(gate, 0), Verdict::kOpen);
}

TEST(Gate, tells_when_nothing_is_as_believed) {
  Gate gate = clean_path();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(reject(gate, 0, true), Verdict::kShut);
    EXPECT_EQ(reject(gate, 1), Verdict::kShut);
  }
  EXPECT_EQ(reject(gate, 0, true), Verdict::kShut);
  EXPECT_EQ(reject(gate, 1), Verdict::kDiverged);
}

}  // namespace
}  // namespace ftcs::estimation
