// SPDX-License-Identifier: MIT
// World: the clocks of kernel_clock_test.cpp on a busy machine: others take the processor for up to
// 6 ms, between two readings or in the middle of a command. Nobody but us steers.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/platform/kernel_clock.h"
#include "test/support/fake_clocks.h"
#include "test/support/fake_preemption.h"

namespace ftcs::platform {
namespace {

constexpr double kMillisecond = 1e6;
constexpr double kSecond = 1e9;
constexpr double kPreemption = 6 * kMillisecond;

enum class Kind { kSystem, kPhc };

ServoCommand correct(double ppm, double ns, double then_ppm) {
  return {Rate::from_ppm(ppm), Duration::from_ns(ns), Rate::from_ppm(then_ppm), Duration{}};
}

class KernelClockPreemptionTest : public testing::TestWithParam<Kind> {
 protected:
  KernelClockPreemptionTest() { kernel.phc.oscillator = 1.0 + 40e-6; }

  [[nodiscard]] KernelClock make() {
    kernel.held_names.clear();
    auto device = GetParam() == Kind::kSystem
                      ? ClockDevice::open_system(kernel, ClockAccess::kSteer)
                      : ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
    EXPECT_TRUE(device.ok());
    return KernelClock(std::move(*device));
  }
  [[nodiscard]] FakeClocks::Clock& truth() {
    return GetParam() == Kind::kSystem ? kernel.system : kernel.phc;
  }
  [[nodiscard]] std::int64_t stamp() { return FakeClocks::kEpoch + std::llround(truth().time_ns); }
  /// The next `times` readings are interrupted right after the clock has been read, so that the
  /// middle of the bracket is 3 ms late.
  void preempt_readings(int times) {
    kernel.on_clock_read = [this, times]() mutable {
      const bool within = kernel.last_read != -1 && kernel.last_read != CLOCK_MONOTONIC_RAW;
      if (!within || times == 0) return;
      --times;
      kernel.run(kPreemption);
    };
  }
  struct Mark {
    double ideal_ns = 0.0;
    FreeRunningTime free{};
  };
  /// A stamp of now, as the clock converts it.
  [[nodiscard]] Mark mark(KernelClock& clock) {
    const double ideal = kernel.ideal_ns;
    const auto free = clock.from_stamp(stamp());
    EXPECT_TRUE(free.has_value());
    return {ideal, free.value_or(FreeRunningTime{})};
  }
  /// Of what the free-running face says has passed.
  [[nodiscard]] double error_since(const Mark& start, KernelClock& clock) {
    const Mark now = mark(clock);
    return (now.free - start.free).ns() - (now.ideal_ns - start.ideal_ns) * truth().oscillator;
  }
  void expect_no_step(KernelClock& clock, const char* where) {
    EXPECT_EQ(clock.foreign_steps(), 0U) << where;
    EXPECT_FALSE(clock.take_foreign_steering().step.has_value()) << where;
  }

  FakeClocks kernel;
};

INSTANTIATE_TEST_SUITE_P(Both, KernelClockPreemptionTest,
                         testing::Values(Kind::kSystem, Kind::kPhc),
                         [](const testing::TestParamInfo<Kind>& kind) {
                           return kind.param == Kind::kSystem ? "system" : "phc";
                         });

// One look in eight takes 40 ns longer, all on one side of the clock, as right after a second has
// passed. What is commanded is anchored to the system clock by its readings: not by these.
TEST_P(KernelClockPreemptionTest, what_makes_a_reading_a_little_longer_each_second_leaves_no_bias) {
  if (GetParam() == Kind::kPhc) GTEST_SKIP() << "the anchor of a hardware clock is itself";
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(0.0, 0.0, 20.0)).ok());
  int look = 0;
  kernel.on_clock_read = [&] {
    if (look % 8 == 7 && kernel.last_read == CLOCK_REALTIME) kernel.run(40.0);
  };
  double sum = 0.0;
  constexpr int kLooks = 800;
  for (look = 0; look < kLooks; ++look) {
    kernel.run(125 * kMillisecond);
    (void)clock.read();
    const auto raw = FreeRunningTime::from_ns(std::llround(kernel.raw));
    sum += (clock.local_at(raw) - clock.local_of(stamp())).ns();
  }
  EXPECT_NEAR(sum / kLooks, 0.0, 0.7);
}

TEST_P(KernelClockPreemptionTest, the_first_reading_is_no_step_of_the_second) {
  for (const int times : {1, 5, 100}) {
    preempt_readings(times);
    KernelClock clock = make();
    kernel.on_clock_read = nullptr;
    for (int i = 0; i < 10; ++i) {
      kernel.run(10 * kMillisecond);
      (void)clock.read();
    }
    expect_no_step(clock, "after the first reading");
    const Mark start = mark(clock);
    kernel.run(100 * kMillisecond);
    EXPECT_NEAR(error_since(start, clock), 0.0, 1'000.0) << times;
  }
}

TEST_P(KernelClockPreemptionTest, the_reading_after_a_command_is_no_step_of_the_next) {
  for (const int times : {1, 5, 100}) {
    KernelClock clock = make();
    kernel.run(100 * kMillisecond);
    const Mark start = mark(clock);
    kernel.on_adjust = [&] { preempt_readings(times); };
    ASSERT_TRUE(clock.apply(correct(20.0, 50 * kMillisecond, 10.0)).ok());
    kernel.on_adjust = kernel.on_clock_read = nullptr;
    for (int i = 0; i < 10; ++i) {
      kernel.run(10 * kMillisecond);
      (void)clock.read();
    }
    expect_no_step(clock, "after a command");
    EXPECT_NEAR(error_since(start, clock), 0.0, 1'000.0) << times;
  }
}

TEST_P(KernelClockPreemptionTest, many_wide_readings_in_a_row_are_no_step) {
  KernelClock clock = make();
  kernel.run(100 * kMillisecond);
  const Mark start = mark(clock);
  preempt_readings(1'000'000);
  for (int i = 0; i < 20; ++i) (void)clock.read();
  kernel.on_clock_read = nullptr;
  expect_no_step(clock, "after wide readings");
  EXPECT_NEAR(error_since(start, clock), 0.0, 1'000.0);
}

// Preempted between the question for the time and the kernel's doing: 6 ms at a rate 3 % off are
// 180 us, of which the middle of the bracket knows half.
TEST_P(KernelClockPreemptionTest, a_command_that_takes_effect_late_is_placed_by_what_it_did) {
  for (const bool before : {true, false}) {
    KernelClock clock = make();
    kernel.run(100 * kMillisecond);
    const Mark start = mark(clock);
    int call = 0;
    kernel.on_adjust = [&] {
      if ((call++ % 2 == 0) == before) kernel.run(kPreemption);
    };
    ASSERT_TRUE(clock.apply(correct(30'000.0, 50 * kMillisecond, -30'000.0)).ok());
    kernel.on_adjust = nullptr;
    kernel.run(10 * kMillisecond);
    expect_no_step(clock, "after a late command");
    EXPECT_NEAR(error_since(start, clock), 0.0, 2'500.0) << before;
  }
}

TEST_P(KernelClockPreemptionTest, a_step_that_was_made_is_seen_and_measured_by_narrow_readings) {
  for (const double step_ns : {20 * kMillisecond, -0.5 * kSecond}) {
    KernelClock clock = make();
    ASSERT_TRUE(clock.apply(correct(0.0, 0.0, 10.0)).ok());
    kernel.run(50 * kMillisecond);
    truth().time_ns += step_ns;
    preempt_readings(5);  // the reading that finds it is wide
    (void)clock.read();
    kernel.on_clock_read = nullptr;
    kernel.run(kMillisecond);
    const ForeignSteering foreign = clock.take_foreign_steering();
    ASSERT_TRUE(foreign.step.has_value()) << step_ns;
    EXPECT_NEAR(foreign.step->ns(), step_ns, 20'000.0);
    EXPECT_EQ(clock.foreign_steps(), 1U);
  }
}

TEST_P(KernelClockPreemptionTest, a_busy_minute_holds_no_step_and_the_free_face_keeps_its_time) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const FakePreemption preemption(kernel, seed);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise_ppm(0.0, 1.0);
    KernelClock clock = make();
    ASSERT_TRUE(clock.apply(correct(0.0, 0.0, 20.0)).ok());
    const Mark start = mark(clock);
    double largest = 0.0;
    for (int i = 0; i < 8 * 60; ++i) {
      kernel.run(0.125 * kSecond);
      largest = std::max(largest, std::abs(error_since(start, clock)));
      const double tracking = 20.0 + 0.01 * noise_ppm(random);
      const double pull = tracking + noise_ppm(random);
      ASSERT_TRUE(clock.apply(correct(pull, 60 * kMillisecond, tracking)).ok());
    }
    expect_no_step(clock, "busy");
    EXPECT_LT(largest, 1'000.0) << "seed " << seed;
  }
}

// Whoever is kept from ending corrections in time says by how much, and forgets it when all is
// well.
TEST_P(KernelClockPreemptionTest, says_how_late_corrections_have_lately_ended) {
  KernelClock clock = make();
  const auto correct_and_end = [&](double late_ns) {
    ASSERT_TRUE(clock.apply(correct(5.0, 15 * kMillisecond, 0.0)).ok());
    kernel.run(static_cast<double>(*clock.wait_for_expiry_ns()) + late_ns);
    (void)clock.read();
    ASSERT_FALSE(clock.expiry().has_value());
  };
  EXPECT_EQ(clock.expiry_lateness(), Duration{});
  correct_and_end(9 * kMillisecond);
  EXPECT_NEAR(clock.expiry_lateness().ns(), 9 * kMillisecond, 0.01 * kMillisecond);
  correct_and_end(2 * kMillisecond);
  EXPECT_NEAR(clock.expiry_lateness().ns(), 9 * 15.0 / 16.0 * kMillisecond, 0.01 * kMillisecond);
  for (int i = 0; i < 150; ++i) correct_and_end(0.01 * kMillisecond);
  EXPECT_LT(clock.expiry_lateness().ns(), 0.02 * kMillisecond);
}

// Or a correction that is made longer for it, up to the next command, would be so for good.
TEST_P(KernelClockPreemptionTest, forgets_how_late_corrections_ended_while_commands_replace_them) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(5.0, 15 * kMillisecond, 0.0)).ok());
  kernel.run(60 * kSecond);  // the machine slept, perhaps
  (void)clock.read();
  EXPECT_NEAR(clock.expiry_lateness().ns(), kSecond, 1.0);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(clock.apply(correct(5.0, 125 * kMillisecond, 0.0)).ok());
    kernel.run(100 * kMillisecond);
  }
  EXPECT_LT(clock.expiry_lateness().ns(), 2 * kMillisecond);
}

}  // namespace
}  // namespace ftcs::platform
