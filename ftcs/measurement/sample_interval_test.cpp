// SPDX-License-Identifier: MIT
#include "ftcs/measurement/sample_interval.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

using namespace std::chrono_literals;

TEST(SampleInterval, an_outage_makes_no_interval_longer_and_a_longer_interval_is_learnt) {
  SampleInterval interval;
  EXPECT_EQ(interval.value(), Duration{});
  interval.add(Nanoseconds{125ms});
  EXPECT_EQ(interval.value(), Duration{Nanoseconds{125ms}});
  interval.add(Nanoseconds{100s});
  EXPECT_EQ(interval.value(), Duration{Nanoseconds{125ms}});
  interval.add(Nanoseconds{1s});
  interval.add(Nanoseconds{1s});
  EXPECT_EQ(interval.value(), Duration{Nanoseconds{1s}});
}

TEST(SampleInterval, stands_when_the_samples_are_of_another_reference) {
  SampleInterval interval;
  interval.add(Nanoseconds{125ms});
  interval.forget_gap();
  EXPECT_EQ(interval.value(), Duration{Nanoseconds{125ms}});
  interval.add(Nanoseconds{1s});
  EXPECT_EQ(interval.value(), Duration{Nanoseconds{1s}});
}

TEST(SampleInterval, more_than_four_intervals_are_an_outage) {
  EXPECT_FALSE(is_outage(Nanoseconds{4s}, Nanoseconds{1s}));
  EXPECT_TRUE(is_outage(Nanoseconds{4'000'000'001}, Nanoseconds{1s}));
  EXPECT_TRUE(is_outage(Nanoseconds{2'000'000'001}, Nanoseconds{1s}, 2));
}

}  // namespace
}  // namespace ftcs
