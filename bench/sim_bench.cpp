// SPDX-License-Identifier: MIT
// Servo cycles a second of the laboratory's one-way path, beside the bare cost of its random
// numbers. What the small adaptive servo loses against the full one: RMS time error (median of 20
// seeds) in worlds of docs/adaptive-servo.md, with the size of each.
#include <algorithm>
#include <vector>

#include <benchmark/benchmark.h>

#include "ftcs/servo/adaptive/adaptive_servo.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/sim/one_way.h"
#include "test/support/exchange_simulator.h"

namespace {

using ftcs::Nanoseconds;

constexpr std::uint64_t kSamples = 1'000'000;

void one_way_ftcs(benchmark::State& state) {
  ftcs::sim::OneWaySpec spec;
  spec.oscillator.parts = {ftcs::sim::ConstantSkew{-0.01}};
  spec.initial_offset = Nanoseconds{-21'000};
  spec.timestamp_noise_ns = 51.5;
  spec.limits = {ftcs::Rate::from_ratio(0.1), ftcs::Rate::from_ratio(1.9)};
  spec.samples = kSamples;
  ftcs::FtcsConfig config;
  config.sync_interval = Nanoseconds{100'000};
  config.limits = spec.limits;
  std::uint64_t seed = 1;
  for (auto _ : state) {
    ftcs::FtcsServo law(config);
    double squares = 0.0;
    ftcs::sim::run_one_way(spec, seed++, law, [&](const ftcs::sim::OneWaySample& sample) {
      squares += sample.time_error_ns * sample.time_error_ns;
    });
    benchmark::DoNotOptimize(squares);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(kSamples) * state.iterations());
}
BENCHMARK(one_way_ftcs)->Unit(benchmark::kMillisecond);

void gaussian_numbers(benchmark::State& state) {
  ftcs::sim::RandomStream random(1, "bench");
  for (auto _ : state) {
    double sum = 0.0;
    for (std::uint64_t i = 0; i < kSamples; ++i) sum += random.normal();
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(kSamples) * state.iterations());
}
BENCHMARK(gaussian_numbers)->Unit(benchmark::kMillisecond);

enum World : std::int64_t { kGaussian, kWander, kSpikes };

ftcs::test::ExchangeScenario scenario_of(std::int64_t world) {
  ftcs::test::ExchangeScenario scenario;
  if (world == kWander) scenario.wander = 1e-8;
  if (world == kSpikes) scenario.spike_probability = 0.02;
  return scenario;
}

template <class Servo>
void exchange(benchmark::State& state) {
  const auto scenario = scenario_of(state.range(0));
  std::vector<double> rms;
  for (auto _ : state) {
    rms.clear();
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      ftcs::test::ExchangeSimulator<Servo> simulator(scenario, Servo{}, seed);
      rms.push_back(simulator.run().rms_ns);
    }
  }
  std::sort(rms.begin(), rms.end());
  state.counters["rms_ns"] = (rms[9] + rms[10]) / 2.0;
  state.counters["bytes"] = sizeof(Servo);
}
BENCHMARK_TEMPLATE(exchange, ftcs::AdaptiveServo)
    ->Arg(kGaussian)
    ->Arg(kWander)
    ->Arg(kSpikes)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_TEMPLATE(exchange, ftcs::SmallAdaptiveServo)
    ->Arg(kGaussian)
    ->Arg(kWander)
    ->Arg(kSpikes)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
