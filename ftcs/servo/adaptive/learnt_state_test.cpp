// SPDX-License-Identifier: MIT
// World: the two-way exchange of test/support/exchange_simulator.h, gaussian 100 ns, 125 ms, an
// oscillator 50 ppm fast; a servo that starts from what an earlier one learnt.
#include "ftcs/servo/learnt_state.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/servo/adaptive/adaptive_servo.h"
#include "test/support/exchange_simulator.h"

namespace ftcs {
namespace {

using test::ExchangeScenario;
using test::ExchangeSimulator;

constexpr double kSkew = 50e-6;

ExchangeScenario world() {
  ExchangeScenario scenario;
  scenario.interval_s = 0.125;
  scenario.cycles = 400;
  return scenario;
}

struct Medians {
  double c5 = 0.0;
  double first_ten_ns = 0.0;
  double rms_ns = 0.0;
};

Medians run(const AdaptiveConfig& config, const ExchangeScenario& scenario = world()) {
  std::vector<double> c5, first, rms;
  for (std::uint64_t seed = 1; seed <= 21; ++seed) {
    ExchangeSimulator<AdaptiveServo> simulator(scenario, AdaptiveServo{config}, seed);
    const auto result = simulator.run();
    c5.push_back(result.c5_cycles);
    first.push_back(result.first_ten_rms_ns);
    rms.push_back(result.rms_ns);
  }
  for (auto* values : {&c5, &first, &rms}) std::sort(values->begin(), values->end());
  return {c5[10], first[10], rms[10]};
}

TEST(LearntState, is_exported_with_its_deviation) {
  ExchangeSimulator<AdaptiveServo> simulator(world(), AdaptiveServo{}, 1);
  EXPECT_FALSE(learnt_from(simulator.servo().snapshot()).has_value());
  (void)simulator.run();
  const auto learnt = learnt_from(simulator.servo().snapshot());
  ASSERT_TRUE(learnt.has_value());
  EXPECT_NEAR(learnt->rate_deviation, kSkew, 5.0 * learnt->rate_sigma);
  EXPECT_LT(learnt->rate_sigma, 5e-9);
  EXPECT_NEAR(learnt->timestamp_noise_ns, 100.0, 20.0);
}

// A classic servo knows no deviation of its rate.
TEST(LearntState, is_nothing_without_a_deviation) {
  ServoSnapshot snapshot;
  snapshot.state = ServoState::kLocked;
  snapshot.rate_ratio = Rate::from_ppm(10.0);
  EXPECT_FALSE(learnt_from(snapshot).has_value());
}

// Two messages give the rate to 1 ppm at best; who knows it to 0.05 ppm starts calmer.
TEST(LearntState, makes_the_start_calmer) {
  AdaptiveConfig config;
  const Medians without = run(config);
  config.learnt = LearntState{kSkew, 5e-8, 100.0};
  const Medians with = run(config);
  EXPECT_LT(with.first_ten_ns, 0.95 * without.first_ten_ns);
  EXPECT_LE(with.c5, without.c5 + 0.25);
  EXPECT_LT(with.rms_ns, 1.1 * without.rms_ns);
}

// The oscillator is another one, or the noise: the state was wrong by far more than it says.
TEST(LearntState, that_is_wrong_is_given_up) {
  for (const LearntState& wrong :
       {LearntState{kSkew + 20e-6, 2e-7, 100.0}, LearntState{-0.01, 2e-7, 100.0},
        LearntState{kSkew, 2e-7, 1.0}, LearntState{kSkew, 2e-7, 1e6}}) {
    AdaptiveConfig config;
    config.learnt = wrong;
    const Medians medians = run(config);
    EXPECT_LT(medians.c5, 20.0) << wrong.rate_deviation << ' ' << wrong.timestamp_noise_ns;
    EXPECT_LT(medians.rms_ns, 15.0) << wrong.rate_deviation << ' ' << wrong.timestamp_noise_ns;
  }
}

TEST(LearntState, that_is_impossible_is_refused) {
  AdaptiveConfig config;
  config.learnt = LearntState{2.0, 1e-7, 100.0};
  EXPECT_EQ(validate(config), ServoConfigError::kLearntState);
  config.learnt = LearntState{0.0, -1.0, 100.0};
  EXPECT_EQ(validate(config), ServoConfigError::kLearntState);
  config.learnt = LearntState{1e-5, 1e-7, 100.0};
  EXPECT_EQ(validate(config), std::nullopt);
}

}  // namespace
}  // namespace ftcs
