// SPDX-License-Identifier: MIT
// World: the two-way exchange of test/support/exchange_simulator.h: 10 us path, 50 ppm skew, 1 ms
// initial offset, 100 ns noise per packet. The limits are those of the goal table
// (docs/adaptive-servo.md); the whole table with its seeds is a scenario suite of its own.
#include "ftcs/servo/adaptive/adaptive_servo.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/exchange_simulator.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {

using test::ExchangeResult;
using test::ExchangeScenario;
using test::ExchangeSimulator;

constexpr int kSeeds = 9;

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct Medians {
  double c5, rms, max, worst_rms;
};

Medians run(const ExchangeScenario& scenario) {
  std::vector<double> c5, rms, max;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{},
                                               static_cast<std::uint64_t>(seed));
    const ExchangeResult result = simulator.run();
    EXPECT_FALSE(result.went_backward);
    EXPECT_EQ(result.steps, 0);
    c5.push_back(result.c5_cycles);
    rms.push_back(result.rms_ns);
    max.push_back(result.max_ns);
  }
  return {median(c5), median(rms), median(max), *std::max_element(rms.begin(), rms.end())};
}

TEST(AdaptiveServo, locks_within_two_cycles_and_runs_far_below_the_noise) {
  const Medians medians = run({});
  EXPECT_LE(medians.c5, 2.0);
  EXPECT_LE(medians.rms, 6.0);
  EXPECT_LE(medians.worst_rms, 12.0);
}

TEST(AdaptiveServo, measures_its_interval_when_none_is_configured) {
  ExchangeScenario scenario;
  scenario.interval_s = 0.125;
  const Medians medians = run(scenario);
  EXPECT_LE(medians.c5, 2.0);
  EXPECT_LE(medians.rms, 6.0);
}

TEST(AdaptiveServo, outliers_hardly_disturb_it) {
  ExchangeScenario scenario;
  scenario.spike_probability = 0.02;
  const Medians medians = run(scenario);
  EXPECT_LE(medians.rms, 10.0);
  EXPECT_LE(medians.max, 60.0);
}

TEST(AdaptiveServo, uses_that_queueing_only_delays) {
  ExchangeScenario scenario;
  scenario.noise = test::DelayNoise::kExponential;
  EXPECT_LE(run(scenario).rms, 4.0);
}

TEST(AdaptiveServo, follows_a_wandering_oscillator) {
  ExchangeScenario scenario;
  scenario.wander = 1e-8;
  EXPECT_LE(run(scenario).rms, 58.0);
}

TEST(AdaptiveServo, follows_frequency_steps) {
  ExchangeScenario scenario;
  scenario.square_ppm = 1.0;
  EXPECT_LE(run(scenario).rms, 185.0);
}

TEST(AdaptiveServo, one_direction_suffices_if_the_path_delay_is_known) {
  ExchangeScenario scenario;
  scenario.one_way = true;
  AdaptiveConfig config;
  config.fixed_path_delay = Nanoseconds{10'000};
  ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{config}, 1);
  const ExchangeResult result = simulator.run();
  EXPECT_LE(result.c5_cycles, 2.5);
  EXPECT_LE(result.rms_ns, 12.0);
}

TEST(AdaptiveServo, repeated_messages_change_nothing) {
  AdaptiveServo servo;
  TimestampPair pair;
  pair.reference = ReferenceTime::from_ns(1'000);
  pair.free_running = FreeRunningTime::from_ns(1'500);
  EXPECT_EQ(servo.update(pair, {}).verdict, SampleVerdict::kUsed);
  EXPECT_EQ(servo.update(pair, {}).verdict, SampleVerdict::kDuplicate);
}

TEST(AdaptiveServo, neither_allocates_nor_grows) {
  static_assert(sizeof(AdaptiveServo) < 16 * 1024);
  AdaptiveServo servo;
  const test::ForbidAllocation guard;
  for (int i = 0; i < 100; ++i) {
    TimestampPair pair;
    pair.direction = i % 2 == 0 ? Direction::kForward : Direction::kBackward;
    pair.reference = ReferenceTime::from_ns(i * 500'000'000LL);
    pair.free_running = FreeRunningTime::from_ns(i * 500'001'000LL + (i * 7919) % 101);
    pair.local = LocalTime{pair.free_running.since_epoch()};
    (void)servo.update(pair, {pair.free_running, pair.local});
  }
  EXPECT_EQ(servo.snapshot().state, ServoState::kLocked);
}

}  // namespace
}  // namespace ftcs
