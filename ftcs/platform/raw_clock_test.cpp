// SPDX-License-Identifier: MIT
// World: two clocks that run alike, read one after the other in 20 ns each; REALTIME may be slewed
// or set.
#include "ftcs/platform/raw_clock.h"

#include <gtest/gtest.h>

#include "ftcs/platform/fake_kernel.h"

namespace ftcs::platform {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr double kBracketNs = 40.0;

TEST(RealtimeToRaw, maps_a_stamp_to_the_raw_instant_at_which_it_was_taken) {
  FakeKernel kernel;
  RealtimeToRaw mapping(kernel);
  const std::int64_t stamp = kernel.realtime_ns;
  const std::int64_t raw = kernel.raw_ns;
  kernel.advance(50'000);
  const auto mapped = mapping.map(stamp);
  ASSERT_TRUE(mapped.ok());
  EXPECT_NEAR((*mapped - FreeRunningTime::from_ns(raw)).ns(), 0.0, kBracketNs);
}

TEST(RealtimeToRaw, corrects_the_age_of_a_stamp_for_a_slew) {
  FakeKernel kernel;
  RealtimeToRaw mapping(kernel);
  // REALTIME gains 400 ppm for 100 ms; the stamp was taken 50 ms before the end.
  kernel.raw_ns += 50 * kMillisecond;
  kernel.realtime_ns += 50 * kMillisecond + 20'000;
  const std::int64_t stamp = kernel.realtime_ns;
  const std::int64_t raw = kernel.raw_ns;
  kernel.raw_ns += 50 * kMillisecond;
  kernel.realtime_ns += 50 * kMillisecond + 20'000;
  const auto mapped = mapping.map(stamp);
  ASSERT_TRUE(mapped.ok());
  EXPECT_NEAR((*mapped - FreeRunningTime::from_ns(raw)).ns(), 0.0, 2 * kBracketNs);
  EXPECT_EQ(mapping.steps(), 0U);
}

TEST(RealtimeToRaw, refuses_a_stamp_from_before_a_step_and_accepts_the_next) {
  for (const std::int64_t step : {5 * kMillisecond, -5 * kMillisecond}) {
    FakeKernel kernel;
    RealtimeToRaw mapping(kernel);
    kernel.advance(kMillisecond);
    const std::int64_t before = kernel.realtime_ns;
    kernel.realtime_ns += step;
    kernel.advance(kMillisecond);
    EXPECT_FALSE(mapping.map(before).ok());
    EXPECT_EQ(mapping.steps(), 1U);

    kernel.advance(kMillisecond);
    const std::int64_t after = kernel.realtime_ns;
    const std::int64_t raw = kernel.raw_ns;
    kernel.advance(kMillisecond);
    const auto mapped = mapping.map(after);
    ASSERT_TRUE(mapped.ok());
    EXPECT_NEAR((*mapped - FreeRunningTime::from_ns(raw)).ns(), 0.0, kBracketNs);
  }
}

TEST(RealtimeToRaw, keeps_the_tightest_reading_when_interrupts_disturb_others) {
  FakeKernel kernel;
  RealtimeToRaw mapping(kernel);
  int reading = 0;
  // Every call but those of the fourth bracket is interrupted for 100 us.
  kernel.on_clock_read = [&] {
    if (reading < 9 || reading > 11) kernel.advance(100'000);
    ++reading;
  };
  EXPECT_LE(mapping.read().width_ns, 200);
}

TEST(RealtimeToRaw, refuses_a_stamp_from_the_future) {
  FakeKernel kernel;
  RealtimeToRaw mapping(kernel);
  const auto mapped = mapping.map(kernel.realtime_ns + kMillisecond);
  ASSERT_FALSE(mapped.ok());
  EXPECT_EQ(mapped.error(), MappingError::kFromTheFuture);
}

TEST(RawClock, never_goes_back_and_follows_the_machine) {
  LinuxKernel kernel;
  RawClock clock(kernel);
  FreeRunningTime last = clock.now();
  for (int i = 0; i < 1000; ++i) {
    const FreeRunningTime now = clock.now();
    ASSERT_GE(now, last);
    last = now;
  }
  RealtimeToRaw mapping(kernel);
  const auto mapped = mapping.map(kernel.clock_ns(CLOCK_REALTIME));
  ASSERT_TRUE(mapped.ok());
  EXPECT_LT(abs(*mapped - clock.now()), Duration::from_whole_ns(100 * kMillisecond));
}

}  // namespace
}  // namespace ftcs::platform
