// SPDX-License-Identifier: MIT
// World: a sequence of messages, late (l) or early (e) against what is
// believed, capitals forward; = and - are messages that are explained, forward
// and backward.
#include "ftcs/estimation/divergence_watch.h"

#include <string_view>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

bool diverged(std::string_view messages) {
  DivergenceWatch watch;
  for (const char each : messages) {
    const bool forward = each == '=' || each == 'L' || each == 'E';
    const bool explained = each == '=' || each == '-';
    watch.observe(forward ? 0 : 1, !explained, each == 'E' || each == 'e');
  }
  return watch.diverged();
}

TEST(DivergenceWatch, four_unexplained_of_each_direction_one_of_them_early) {
  EXPECT_TRUE(diverged("LlLlLlEl"));
  EXPECT_TRUE(diverged("LeLlLlLl"));
  EXPECT_FALSE(diverged("LlElLlL"));
}

TEST(DivergenceWatch, late_in_both_directions_is_a_longer_path_or_a_host_that_stood_still) {
  EXPECT_FALSE(diverged("LlLlLlLlLlLlLlLlLlLl"));
}

TEST(DivergenceWatch, one_direction_alone_is_the_business_of_the_gate) {
  EXPECT_FALSE(diverged("E-E-E-E-E-E-E-E-E-E-"));
  EXPECT_FALSE(diverged("eeeeeeeeeeee"));
}

TEST(DivergenceWatch, what_is_explained_takes_away) {
  EXPECT_FALSE(diverged("LeLe=-LeLe==--"));
  EXPECT_TRUE(diverged("LeLeLe=-LeLe"));
  EXPECT_FALSE(diverged("e-LlLlLlLl")) << "the early one is forgotten";
}

}  // namespace
}  // namespace ftcs::estimation
