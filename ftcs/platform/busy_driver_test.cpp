// SPDX-License-Identifier: MIT
// World: a hardware clock 40 ppm fast whose driver answers EBUSY now and then, as one does that
// shares its bus or its firmware: to readings, comparisons and commands.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/platform/cross_timestamp.h"
#include "ftcs/platform/kernel_clock.h"
#include "test/support/fake_clocks.h"

namespace ftcs::platform {
namespace {

constexpr double kMillisecond = 1e6;
constexpr double kSecond = 1e9;

ServoCommand correct(double ppm, double ns, double then_ppm) {
  return {Rate::from_ppm(ppm), Duration::from_ns(ns), Rate::from_ppm(then_ppm), Duration{}};
}

class BusyDriver : public testing::Test {
 protected:
  BusyDriver() { kernel.phc.oscillator = 1.0 + 40e-6; }

  [[nodiscard]] KernelClock make() {
    auto device = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
    EXPECT_TRUE(device.ok());
    return KernelClock(std::move(*device));
  }
  /// Each call, with this probability.
  void be_busy(double probability) {
    kernel.driver_is_busy = [this, probability] {
      return std::bernoulli_distribution(probability)(random_);
    };
  }
  [[nodiscard]] std::int64_t stamp() const {
    return FakeClocks::kEpoch + std::llround(kernel.phc.time_ns);
  }

  FakeClocks kernel;

 private:
  std::mt19937_64 random_{1};
};

TEST_F(BusyDriver, that_is_busy_now_and_then_costs_no_time_and_no_step) {
  KernelClock clock = make();
  const double start_ideal = kernel.ideal_ns;
  const auto start = clock.from_stamp(stamp());
  ASSERT_TRUE(start.has_value());
  be_busy(0.6);  // one call in thirteen fails five times in a row
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    kernel.run(100 * kMillisecond);
    if (!clock.apply(correct(i % 2 == 0 ? 300.0 : -300.0, 20 * kMillisecond, 0.0)).ok()) ++refused;
    kernel.run(25 * kMillisecond);
    (void)clock.read();
  }
  kernel.driver_is_busy = nullptr;
  kernel.run(100 * kMillisecond);
  (void)clock.read();
  EXPECT_FALSE(clock.failure().has_value());
  EXPECT_GT(refused, 0) << "the world is as meant";
  EXPECT_EQ(clock.foreign_steps(), 0U);
  const auto end = clock.from_stamp(stamp());
  ASSERT_TRUE(end.has_value());
  const double passed = (kernel.ideal_ns - start_ideal) * kernel.phc.oscillator;
  EXPECT_NEAR((*end - *start).ns(), passed, 1000.0) << "each change is placed to some nanoseconds";
}

// Five readings in one call are refused as soon as one of them is.
TEST_F(BusyDriver, that_is_busy_for_one_call_in_five_is_compared_nine_times_in_ten) {
  for (const int extended_errno : {0, EOPNOTSUPP}) {
    kernel.driver_is_busy = nullptr;
    kernel.extended_errno = extended_errno;
    auto device = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kRead);
    ASSERT_TRUE(device.ok());
    CrossTimestamper comparison(kernel, *device);
    kernel.busy_by_reading = true;
    be_busy(0.2);  // before the readings, and with each
    int failed = 0;
    for (int i = 0; i < 1000; ++i) failed += comparison.read(5) ? 0 : 1;
    EXPECT_LT(failed, 100) << name(comparison.method());
    EXPECT_GT(failed, 0) << "the world is as meant";
  }
}

TEST_F(BusyDriver, that_cannot_be_read_for_a_second_does_not_prolong_a_correction) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(30'000.0, 100 * kMillisecond, 5.0)).ok());
  kernel.driver_is_busy = [] { return true; };
  kernel.run(90 * kMillisecond);
  (void)clock.read();
  EXPECT_TRUE(clock.expiry().has_value());
  int calls = 0;
  kernel.driver_is_busy = [&calls] { return ++calls <= 5; };  // it takes commands again, no more
  kernel.run(10.1 * kMillisecond);
  (void)clock.read();
  EXPECT_FALSE(clock.expiry().has_value());
  EXPECT_NEAR(kernel.phc.steering(), 1.0 + 5e-6, 2e-11);
}

TEST_F(BusyDriver, that_refuses_at_the_end_is_asked_again_before_the_program_goes) {
  KernelClock clock = make();
  ASSERT_TRUE(clock.apply(correct(30'000.0, kSecond, 5.0)).ok());
  kernel.run(10 * kMillisecond);
  be_busy(0.5);
  clock.settle_at(Rate::from_ppm(7.0));
  EXPECT_FALSE(clock.expiry().has_value());
  EXPECT_NEAR(kernel.phc.steering(), 1.0 + 7e-6, 2e-11);
}

TEST_F(BusyDriver, that_never_answers_again_is_a_failure_after_ten_seconds) {
  KernelClock clock = make();
  kernel.driver_is_busy = [] { return true; };
  for (int i = 0; i < 9; ++i) {
    kernel.run(kSecond);
    (void)clock.read();
  }
  EXPECT_FALSE(clock.failure().has_value());
  for (int i = 0; i < 3; ++i) {
    kernel.run(kSecond);
    (void)clock.read();
  }
  EXPECT_EQ(clock.failure(), ClockError::kBusy);
}

TEST_F(BusyDriver, is_not_taken_for_one_that_lacks_the_better_method) {
  kernel.precise_errno = 0;
  int calls = 0;
  kernel.driver_is_busy = [&calls] { return ++calls <= 3; };
  const auto device = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kRead);
  ASSERT_TRUE(device.ok());
  CrossTimestamper cross(kernel, *device);
  EXPECT_EQ(cross.method(), CrossMethod::kPrecise);
  calls = 0;
  EXPECT_TRUE(cross.read(5).ok()) << "nor does it cost a reading";
}

}  // namespace
}  // namespace ftcs::platform
