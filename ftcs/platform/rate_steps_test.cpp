// SPDX-License-Identifier: MIT
// World: a clock 20 ppm fast that makes multiples of a step of what it is told, read sixteen times
// a second against another oscillator with noise; it is told what a servo says that follows a noisy
// reference: tracking rates that wander by some ppb, and corrections by some 100 ppb in between.
#include "ftcs/platform/rate_steps.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/platform/kernel_clock.h"
#include "test/support/fake_clocks.h"

namespace ftcs::platform {
namespace {

class World {
 public:
  World(double step, double noise_ns, unsigned seed)
      : step_(step), noise_ns_(noise_ns), random_(seed) {}

  double wander = 0.0;        ///< of the oscillator, in a sixteenth of a second
  double oscillator = 20e-6;  ///< its deviation
  double late_reading = 0.0;  ///< a share of readings is wrong
  double wrong_by_ns = 3000.0;
  double stamps_ns = 100.0;  ///< noise of the reference's
  RateStepMeter meter;

  [[nodiscard]] double made_of(double command) const {
    return step_ > 0.0 ? std::round(command / step_) * step_ : command;
  }
  /// A servo of second order, sixteen times a second.
  void run(double seconds) {
    constexpr double kCorrectionNs = 15e6, kIntervalNs = 62.5e6;
    for (int i = 0; i < seconds * 16; ++i) {
      oscillator += wander * normal_(random_);
      const double error = gained_ns_ + stamps_ns * normal_(random_) - offset_ns_;
      offset_ns_ += 0.05 * error;
      drift_ += 0.002 * error / kIntervalNs;
      hold(-drift_ - offset_ns_ / kCorrectionNs, kCorrectionNs);
      hold(-drift_, kIntervalNs - kCorrectionNs);
    }
  }

 private:
  void hold(double command, double ns) {
    command = meter.steps().nearest(command);
    offset_ns_ += (command + drift_) * ns;
    read(command);
    raw_ns_ += ns;
    gained_ns_ += ns * (made_of(command) + oscillator);
    read(command);
    meter.on_change(command, std::llround(raw_ns_), 0.0);
  }
  void read(double command) {
    const bool late = std::uniform_real_distribution<>()(random_) < late_reading;
    const double error = noise_ns_ * normal_(random_) + (late ? wrong_by_ns : 0.0);
    meter.on_reading(command, std::llround(raw_ns_), std::llround(raw_ns_ + gained_ns_ + error));
  }

  double step_, noise_ns_;
  std::mt19937 random_;
  std::normal_distribution<> normal_;
  double offset_ns_ = 0.0, drift_ = 20e-6;  // as the servo knows them
  double raw_ns_ = 1e12, gained_ns_ = 0.0;
};

// What of a command can be relied on: that the clock does it, but for what is constant.
double unreliability(World& world) {
  std::vector<double> differences;
  for (double command = -20.3e-6; command < -19.7e-6; command += 7e-9) {
    const double told = world.meter.steps().nearest(command);
    differences.push_back(world.made_of(told) - told);
  }
  double mean = 0.0, worst = 0.0;
  for (const double difference : differences)
    mean += difference / static_cast<double>(differences.size());
  for (const double difference : differences) worst = std::max(worst, std::abs(difference - mean));
  return worst;
}

TEST(RateSteps, the_nearest_one_lies_between_two_thresholds) {
  const RateSteps steps{100e-9, 1000e-9};
  EXPECT_NEAR(steps.nearest(1001e-9), 1050e-9, 1e-15);
  EXPECT_NEAR(steps.nearest(1099e-9), 1050e-9, 1e-15);
  EXPECT_NEAR(steps.nearest(999e-9), 950e-9, 1e-15);
  EXPECT_EQ(steps.nearest(3e-6), 3e-6) << "too far from what was learnt";
  EXPECT_EQ(RateSteps{}.nearest(123e-9), 123e-9);
}

TEST(RateStepMeter, learns_the_steps_of_a_register_within_15_seconds) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    World world(119.209e-9, 2.0, seed);
    EXPECT_GT(unreliability(world), 55e-9);
    world.run(15);
    EXPECT_NEAR(world.meter.steps().size, 119.209e-9, 6e-9) << seed;
    EXPECT_LT(unreliability(world), 20e-9) << seed;
  }
}

TEST(RateStepMeter, learns_them_from_noisy_readings_some_of_which_are_late) {
  int learnt = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    World world(119.209e-9, 10.0, seed);
    world.late_reading = 0.001;
    world.run(120);
    if (unreliability(world) < 40e-9) ++learnt;
  }
  EXPECT_GE(learnt, 7);
}

TEST(RateStepMeter, learns_nothing_from_a_clock_that_keeps_to_its_commands) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    World world(0.0, seed * 10.0, seed);
    world.wander = seed % 2 == 0 ? 0.25e-9 : 0.0;
    world.late_reading = 0.01;
    for (int i = 0; i < 30; ++i) {
      world.run(5);
      EXPECT_EQ(world.meter.steps().size, 0.0) << seed << " after " << 5 * i << " s";
    }
  }
}

// Commands that hardly differ, as from stamps without noise: a few wrong readings are all that
// there is to be explained.
TEST(RateStepMeter, learns_nothing_from_a_few_wrong_readings) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    World world(0.0, 0.3, seed);
    world.stamps_ns = 1.0;
    world.late_reading = 0.01;
    world.wrong_by_ns = 300.0;
    for (int i = 0; i < 12; ++i) {
      world.run(1);
      EXPECT_EQ(world.meter.steps().size, 0.0) << seed << " after " << i + 1 << " s";
    }
  }
}

TEST(RateStepMeter, learns_anew_where_the_oscillator_has_gone_elsewhere) {
  World world(119.209e-9, 2.0, 7);
  world.run(30);
  world.oscillator += 5e-6;
  world.run(5);
  EXPECT_EQ(world.meter.steps().size, 0.0);
  world.run(40);
  EXPECT_NEAR(world.meter.steps().size, 119.209e-9, 6e-9);
}

TEST(RateStepMeter, keeps_what_it_has_learnt_when_the_clock_is_set) {
  World world(119.209e-9, 2.0, 8);
  world.run(30);
  world.meter.restart();
  world.run(5);
  EXPECT_NEAR(world.meter.steps().size, 119.209e-9, 6e-9);
}

// What the free-running face of a hardware clock, rebuilt from the commands, gains on the true
// oscillator in a tenth of a second, by command: the same for all, if the clock did what it was
// told.
double spread_of_free_running(KernelClock& clock, FakeClocks& kernel) {
  double least = 1.0, most = -1.0;
  for (double ppm = -20.15; ppm < -19.85; ppm += 0.017) {
    EXPECT_TRUE(clock.apply({Rate::from_ppm(ppm), {}, Rate::from_ppm(ppm), {}}).ok());
    const double from = kernel.ideal_ns;
    const FreeRunningTime before = clock.read().free_running;
    kernel.run(1e8);
    const double gained =
        (clock.read().free_running - before).ns() / (kernel.ideal_ns - from) - 1.0;
    least = std::min(least, gained);
    most = std::max(most, gained);
  }
  return most - least;
}

TEST(KernelClockWithRateSteps, is_steered_to_rates_that_it_can_keep) {
  FakeClocks kernel;
  kernel.phc.oscillator = 1.0 + 20e-6;
  kernel.phc.rate_step = 119.209e-9;
  auto device = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
  ASSERT_TRUE(device.ok());
  KernelClock clock(std::move(*device));
  EXPECT_GT(spread_of_free_running(clock, kernel), 100e-9);
  std::mt19937 random(1);
  std::normal_distribution<> noise(0.0, 60e-3);
  for (int i = 0; i < 30 * 16; ++i) {
    const Rate rate = Rate::from_ppm(-20.0 + noise(random));
    EXPECT_TRUE(clock.apply({rate, {}, rate, {}}).ok());
    for (int j = 0; j < 3; ++j) {
      kernel.run(2e7);
      (void)clock.read();
    }
  }
  EXPECT_LT(spread_of_free_running(clock, kernel), 30e-9);
}

}  // namespace
}  // namespace ftcs::platform
