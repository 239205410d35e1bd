// SPDX-License-Identifier: MIT
// Servo cycles a second of the laboratory's one-way path, beside the bare cost of its random
// numbers.
#include <benchmark/benchmark.h>

#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/sim/one_way.h"

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

}  // namespace

BENCHMARK_MAIN();
