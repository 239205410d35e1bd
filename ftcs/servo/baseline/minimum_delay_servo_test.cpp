// SPDX-License-Identifier: MIT
// World: an oscillator 20 ppm fast that nobody steers, an exchange a second over a path of 10 us
// with 20 ns of noise, in which a part of the messages of each direction waits for milliseconds.
#include "ftcs/servo/baseline/minimum_delay_servo.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/servo/in_order.h"

namespace ftcs {
namespace {

constexpr double kSkew = 20e-6;
constexpr double kDelayNs = 10'000.0;

struct World {
  double share_waiting = 0.0;
  std::mt19937_64 engine{1};  // NOLINT(cert-msc32-c,cert-msc51-cpp) reproducible
  std::normal_distribution<double> noise{0.0, 20.0};
  std::uniform_real_distribution<double> uniform{0.0, 1.0};

  double late_ns() {
    const double extra = uniform(engine) < share_waiting ? 2e6 * uniform(engine) : 0.0;
    return noise(engine) + extra;
  }
  static Duration free_running(double reference_ns) {
    return Duration::from_ns(reference_ns * (1.0 + kSkew));
  }
  TimestampPair forward(int n) {
    const double t1 = 1e9 * n;
    const Duration t2 = free_running(t1 + kDelayNs + late_ns());
    return {Direction::kForward, ReferenceTime{Duration::from_ns(t1)}, LocalTime{t2},
            FreeRunningTime{t2}};
  }
  TimestampPair backward(int n) {
    const double sent = 1e9 * n + 3e8;
    const Duration t3 = free_running(sent);
    return {Direction::kBackward, ReferenceTime{Duration::from_ns(sent + kDelayNs + late_ns())},
            LocalTime{t3}, FreeRunningTime{t3}};
  }
};

/// Largest error of the stated offset over the last third, ns. The local clock is the oscillator.
double largest_error_ns(const MinimumDelayConfig& config, double share_waiting) {
  World world{share_waiting};
  MinimumDelayServo servo{config};
  double largest = 0.0;
  constexpr int kCycles = 900;
  for (int n = 0; n < kCycles; ++n) {
    const TimestampPair sync = world.forward(n);
    (void)servo.update(sync, {sync.free_running, sync.local});
    const TimestampPair request = world.backward(n);
    const ServoUpdate update = servo.update(request, {request.free_running, request.local});
    if (!update.has_command || n < kCycles * 2 / 3) continue;
    const double true_offset_ns = kSkew / (1.0 + kSkew) * request.local.since_epoch().ns();
    largest = std::max(largest, std::abs(servo.snapshot().offset.ns() - true_offset_ns));
  }
  return largest;
}

MinimumDelayConfig windowed() {
  MinimumDelayConfig config;
  config.selection = DelaySelection::kWindow;
  return config;
}

TEST(MinimumDelayServo, follows_a_quiet_path_by_either_selection) {
  EXPECT_LT(largest_error_ns({}, 0.0), 60.0);
  EXPECT_LT(largest_error_ns(windowed(), 0.0), 200.0);
}

// A fifth waits, 1 ms on average: a mean would be 200 us off.
TEST(MinimumDelayServo, believes_exchanges_that_did_not_wait) {
  EXPECT_LT(largest_error_ns({}, 0.2), 60'000.0);
  EXPECT_LT(largest_error_ns(windowed(), 0.2), 300.0);
}

TEST(MinimumDelayServo, commands_the_rate_of_the_line) {
  World world;
  MinimumDelayServo servo;
  ServoUpdate latest;
  for (int n = 0; n < 100; ++n) {
    const TimestampPair sync = world.forward(n);
    (void)servo.update(sync, {sync.free_running, sync.local});
    const TimestampPair request = world.backward(n);
    latest = servo.update(request, {request.free_running, request.local});
  }
  ASSERT_TRUE(latest.has_command);
  EXPECT_NEAR(latest.command.tracking_rate.ppb(), -20'000.0, 5.0);
  EXPECT_NEAR(servo.snapshot().path_delay.ns(), kDelayNs, 60.0);
}

TEST(MinimumDelayServo, repeated_and_impossible_messages_change_nothing) {
  World world;
  InOrder<MinimumDelayServo> servo;
  const TimestampPair sync = world.forward(5);
  (void)servo.update(sync, {sync.free_running, sync.local});
  EXPECT_EQ(servo.update(sync, {}).verdict, SampleVerdict::kDuplicate);
  TimestampPair impossible = world.forward(6);
  impossible.free_running = world.forward(4).free_running;
  EXPECT_EQ(servo.update(impossible, {}).verdict, SampleVerdict::kImplausible);
}

TEST(MinimumDelayServo, refuses_a_window_of_nothing) {
  MinimumDelayConfig config;
  config.window = 0;
  EXPECT_EQ(validate(config), ServoConfigError::kWindow);
}

}  // namespace
}  // namespace ftcs
