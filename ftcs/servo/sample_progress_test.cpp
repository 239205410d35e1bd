// SPDX-License-Identifier: MIT
// World: two samples, 125 ms apart or as the test says, on a reference and an oscillator.
#include "ftcs/servo/sample_progress.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

SyncSample sample_at(std::int64_t origin_ns, std::int64_t free_running_ns) {
  return {ReferenceTime::from_ns(origin_ns), Duration{}, LocalTime{},
          FreeRunningTime::from_ns(free_running_ns)};
}

SampleVerdict verdict_of(std::int64_t reference_ns, std::int64_t free_running_ns) {
  return progress_between(sample_at(1'000'000'000, 2'000'000'000),
                          sample_at(1'000'000'000 + reference_ns, 2'000'000'000 + free_running_ns),
                          RateLimits{})
      .verdict;
}

TEST(SampleProgress, is_the_time_elapsed_on_both_clocks) {
  const SampleProgress progress =
      progress_between(sample_at(1'000, 70'000), sample_at(1'150, 70'100), RateLimits{});
  EXPECT_EQ(progress.verdict, SampleVerdict::kUsed);
  EXPECT_EQ(progress.reference, Duration{Nanoseconds{150}});
  EXPECT_EQ(progress.free_running, Duration{Nanoseconds{100}});
  EXPECT_EQ(progress.ratio(), Rate::from_ratio(1.5));
}

TEST(SampleProgress, newer_on_neither_clock_is_a_duplicate) {
  EXPECT_EQ(verdict_of(0, 0), SampleVerdict::kDuplicate);
  EXPECT_EQ(verdict_of(-5, -5), SampleVerdict::kDuplicate);
  EXPECT_EQ(verdict_of(0, -5), SampleVerdict::kDuplicate);
  EXPECT_EQ(verdict_of(-5, 0), SampleVerdict::kDuplicate);
}

TEST(SampleProgress, newer_on_one_clock_only_is_implausible) {
  EXPECT_EQ(verdict_of(100, 0), SampleVerdict::kImplausible);
  EXPECT_EQ(verdict_of(0, 100), SampleVerdict::kImplausible);
  EXPECT_EQ(verdict_of(100, -100), SampleVerdict::kImplausible);
  EXPECT_EQ(verdict_of(-100, 100), SampleVerdict::kImplausible);
}

TEST(SampleProgress, ratio_outside_the_bounds_is_implausible) {
  EXPECT_EQ(verdict_of(150, 100), SampleVerdict::kUsed);
  EXPECT_EQ(verdict_of(151, 100), SampleVerdict::kImplausible);
  EXPECT_EQ(verdict_of(50, 100), SampleVerdict::kUsed);
  EXPECT_EQ(verdict_of(49, 100), SampleVerdict::kImplausible);
}

}  // namespace
}  // namespace ftcs
