// SPDX-License-Identifier: MIT
// World: the two-way exchange of test/support/exchange_simulator.h: 10 us path, 50 ppm skew, 1 ms
// initial offset, 100 ns noise per packet. The limits are those of the goal table
// (docs/adaptive-servo.md); the whole table with its seeds is a scenario suite of its own.
#include "ftcs/servo/adaptive/adaptive_servo.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/servo/in_order.h"
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

/// Two clocks whose stamps have the same steps, one steered to the other: what each stamp loses is
/// the same, and what is left of noise are a few values.
ExchangeScenario stepped(double step_ns, double noise_ns) {
  ExchangeScenario scenario;
  scenario.interval_s = 0.125000001371;  // on no grid of the steps
  scenario.cycles = 2400;
  scenario.skew_ppm = 20.0;
  scenario.path_delay_ns = 1'000.0;
  scenario.noise_ns = noise_ns;
  scenario.step_ns = step_ns;
  return scenario;
}

/// Without noise the last messages lie on one line to the digit: nothing is to be begun anew for
/// that (2 ns at most without the second opinion's least_noise).
TEST(AdaptiveServo, a_path_without_noise_is_followed_below_the_steps_of_its_stamps) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    ExchangeSimulator<AdaptiveServo> simulator(stepped(1.0, 0.0), AdaptiveServo{}, seed);
    EXPECT_LE(simulator.run().max_ns, 0.3) << seed;
  }
}

/// With noise of a step or less most residuals are zero, and so is their median (10 to 70 ns at
/// most without the dither of the learner's window).
TEST(AdaptiveServo, steps_of_eight_nanoseconds_are_averaged_away) {
  for (const double noise : {4.0, 6.0, 8.0}) {
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      ExchangeSimulator<AdaptiveServo> simulator(stepped(8.0, noise), AdaptiveServo{}, seed);
      const ExchangeResult result = simulator.run();
      EXPECT_LE(result.max_ns, 2.0) << noise << ", " << seed;
      EXPECT_LE(result.rms_ns, 0.6) << noise << ", " << seed;
    }
  }
}

/// Of so many runs, mean of the RMS in ns.
template <class Servo>
double mean_rms(const ExchangeScenario& scenario, int runs) {
  double sum = 0.0;
  for (int seed = 1; seed <= runs; ++seed) {
    ExchangeSimulator<Servo> simulator(scenario, Servo{}, static_cast<std::uint64_t>(seed));
    sum += simulator.run().rms_ns;
  }
  return sum / runs;
}

/// Before variances have been learnt too (1.9 ns without the dither of the residuals).
TEST(AdaptiveServo, steps_of_eight_nanoseconds_are_averaged_away_from_the_fifth_second_on) {
  ExchangeScenario scenario = stepped(8.0, 4.0);
  scenario.cycles = 64;
  EXPECT_LE(mean_rms<AdaptiveServo>(scenario, 60), 1.3);
}

/// It has the median of the residuals alone (1.8 ns without their dither).
TEST(AdaptiveServo, the_small_variant_averages_steps_away) {
  EXPECT_LE(mean_rms<SmallAdaptiveServo>(stepped(8.0, 4.0), 9), 0.8);
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

/// Messages 125 ms apart on a path of 11 us that was said to take 10; returns the last snapshot.
ServoSnapshot follow(AdaptiveServo& servo, int from, int to) {
  for (int i = from; i < to; ++i) {
    const bool forward = i % 2 == 0;
    const std::int64_t at = 125'000'000LL * i;
    const std::int64_t reference = at + (forward ? -11'000 : 11'000);
    const TimestampPair pair{forward ? Direction::kForward : Direction::kBackward,
                             ReferenceTime::from_ns(reference), LocalTime::from_ns(at),
                             FreeRunningTime::from_ns(at)};
    static_cast<void>(servo.update(pair, {pair.free_running, pair.local}));
  }
  return servo.snapshot();
}

TEST(AdaptiveServo, a_path_delay_that_was_given_may_be_set_free) {
  AdaptiveConfig config;
  config.fixed_path_delay = Nanoseconds{10'000};
  AdaptiveServo servo{config};
  EXPECT_NEAR(follow(servo, 0, 100).path_delay.ns(), 10'000.0, 0.01);
  servo.free_path_delay(1'000.0);
  const ServoSnapshot free = follow(servo, 100, 300);
  EXPECT_NEAR(free.path_delay.ns(), 11'000.0, 1.0);
  EXPECT_NEAR(free.offset.ns(), 0.0, 1.0);
  servo.reset();
  EXPECT_NEAR(follow(servo, 300, 310).path_delay.ns(), 10'000.0, 0.01);
}

TEST(AdaptiveServo, the_small_variant_locks_as_quickly_and_stays_below_the_noise) {
  std::vector<double> c5, rms;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    ExchangeSimulator<SmallAdaptiveServo> simulator({}, SmallAdaptiveServo{}, seed);
    const ExchangeResult result = simulator.run();
    c5.push_back(result.c5_cycles);
    rms.push_back(result.rms_ns);
  }
  EXPECT_LE(median(c5), 2.0);
  EXPECT_LE(median(rms), 20.0);
}

TEST(AdaptiveServo, repeated_messages_change_nothing) {
  InOrder<AdaptiveServo> servo;
  TimestampPair pair;
  pair.reference = ReferenceTime::from_ns(1'000);
  pair.free_running = FreeRunningTime::from_ns(1'500);
  EXPECT_EQ(servo.update(pair, {}).verdict, SampleVerdict::kUsed);
  EXPECT_EQ(servo.update(pair, {}).verdict, SampleVerdict::kDuplicate);
}

TEST(AdaptiveServo, survives_dense_spikes_in_every_run) {
  ExchangeScenario scenario;
  scenario.spike_probability = 0.1;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{}, seed);
    EXPECT_LE(simulator.run().max_ns, 60.0) << seed;
  }
}

TEST(AdaptiveServo, follows_a_step_of_the_reference_within_three_cycles) {
  ExchangeScenario scenario;
  scenario.reference_step_ns = 20'000.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{}, seed);
    const ExchangeResult result = simulator.run();
    EXPECT_LE(result.event_max_ns, 600.0) << seed;
    EXPECT_LE(result.overshoot_ns, 1'000.0) << seed;
  }
}

TEST(AdaptiveServo, a_longer_path_hardly_disturbs_the_offset) {
  ExchangeScenario scenario;
  scenario.path_step_ns = 15'000.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{}, seed);
    EXPECT_LE(simulator.run().max_ns, 1'000.0) << seed;
  }
}

/// Pooled over quiet, wandering, loaded and disturbed runs, between messages too.
TEST(AdaptiveServo, reported_deviation_is_honest) {
  std::vector<ExchangeScenario> scenarios(6);
  scenarios[1].wander = 1e-8;
  scenarios[2].sine_ppm = 0.5;
  scenarios[3].spike_probability = 0.1;
  scenarios[4].forward_load_ns = 1000.0;
  scenarios[5].outage_start_s = 600.0;
  scenarios[5].outage_end_s = 660.0;
  double inside[3] = {};
  double runs = 0.0;
  for (const ExchangeScenario& scenario : scenarios) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{}, seed);
      const ExchangeResult result = simulator.run();
      inside[0] += result.inside_1;
      inside[1] += result.inside_2;
      inside[2] += result.inside_3;
      runs += 1.0;
    }
  }
  EXPECT_GE(inside[0] / runs, 0.60);
  EXPECT_LE(inside[0] / runs, 0.80);  // most of these oscillators are calm: slow_wander_test.cpp
  EXPECT_GE(inside[1] / runs, 0.92);
  EXPECT_LE(inside[1] / runs, 0.985);
  EXPECT_GE(inside[2] / runs, 0.99);
}

TEST(AdaptiveServo, without_messages_its_bound_grows) {
  ExchangeScenario scenario;
  scenario.cycles = 300;
  scenario.wander = 1e-9;
  scenario.outage_start_s = 200.0;
  scenario.outage_end_s = 400.0;
  ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{}, 3);
  (void)simulator.run();
  const ClockReading late = simulator.reading();
  const ServoSnapshot before = simulator.servo().snapshot();
  const ServoSnapshot after = simulator.servo().snapshot_at(late);
  EXPECT_EQ(before.state, ServoState::kLocked);
  EXPECT_GT(after.offset_sigma_ns, 10.0 * before.offset_sigma_ns);
  EXPECT_LT(std::abs(simulator.error_ns() - after.offset.ns()), 4.0 * after.offset_sigma_ns);
}

TEST(AdaptiveServo, neither_allocates_nor_grows) {
  static_assert(sizeof(AdaptiveServo) < 16 * 1024);
  static_assert(sizeof(SmallAdaptiveServo) < 1024);
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
