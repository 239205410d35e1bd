// SPDX-License-Identifier: MIT
// World: two clocks that run alike, read one after the other in 20 ns each; REALTIME may be slewed
// or set.
#include "ftcs/platform/raw_clock.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "test/support/fake_kernel.h"

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

// Interrupted right after REALTIME was read, `times` times: the middle of the bracket is 3 ms late.
void preempt(FakeKernel& kernel, int times) {
  kernel.on_clock_read = [&kernel, times, call = 0]() mutable {
    const bool second_raw = call++ % 3 == 2;
    if (second_raw && times-- > 0) kernel.advance(6 * kMillisecond);
  };
}

TEST(RealtimeToRaw, a_preempted_reading_is_no_step_and_moves_no_stamp) {
  for (const int times : {1, 5, 1000}) {
    for (const bool baseline : {true, false}) {
      FakeKernel kernel;
      if (baseline) preempt(kernel, times);
      RealtimeToRaw mapping(kernel);
      if (baseline) kernel.on_clock_read = nullptr;
      for (int i = 0; i < 20; ++i) {
        kernel.advance(5 * kMillisecond);
        const std::int64_t stamp = kernel.realtime_ns;
        const std::int64_t raw = kernel.raw_ns;
        if (!baseline && i == 10) preempt(kernel, times);
        const auto mapped = mapping.map(stamp);
        kernel.on_clock_read = nullptr;
        ASSERT_TRUE(mapped.ok()) << times << " readings, " << i;
        EXPECT_NEAR((*mapped - FreeRunningTime::from_ns(raw)).ns(), 0.0, 2 * kBracketNs)
            << times << " readings, " << i;
      }
      EXPECT_EQ(mapping.steps(), 0U);
    }
  }
}

// A slew of 400 ppm all the time, seen by a machine that is preempted at random for 60 s.
TEST(RealtimeToRaw, a_busy_minute_holds_no_step_and_no_wrong_slew) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    FakeKernel kernel;
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform;
    double slewed = 0.0;
    const auto pass = [&](std::int64_t ns) {
      kernel.advance(ns);
      slewed += 400e-6 * static_cast<double>(ns);
      kernel.realtime_ns += static_cast<std::int64_t>(slewed);
      slewed -= std::floor(slewed);
    };
    bool again = false;
    kernel.on_clock_read = [&] {
      again = uniform(random) < (again ? 0.8 : 0.05);
      if (again) pass(6 * kMillisecond);
    };
    RealtimeToRaw mapping(kernel);
    for (int i = 0; i < 8 * 60; ++i) {
      pass(125 * kMillisecond);
      const std::int64_t stamp = kernel.realtime_ns;
      const std::int64_t raw = kernel.raw_ns;
      const auto mapped = mapping.map(stamp);
      ASSERT_TRUE(mapped.ok());
      // The age of a stamp is up to 0.2 s where every reading was preempted.
      if (i <= 5) continue;
      EXPECT_NEAR((*mapped - FreeRunningTime::from_ns(raw)).ns(), 0.0, 1'000.0) << seed;
    }
    EXPECT_EQ(mapping.steps(), 0U) << "seed " << seed;
  }
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
