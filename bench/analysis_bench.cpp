// SPDX-License-Identifier: MIT
// Seconds per statistic of ten million phase points, every octave of tau, and nanoseconds per value
// of the streaming ones. Goals on one core of a PC: each deviation and MTIE below 10 s.
#include <cstddef>
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "ftcs/analysis/mtie.h"
#include "ftcs/analysis/quantile_sketch.h"
#include "ftcs/analysis/stability.h"
#include "ftcs/analysis/statistics.h"

namespace ftcs {
namespace {

constexpr std::size_t kPoints = 10000000;

/// A walk of equal steps up and down by a congruential generator: quick to make, and no value
/// repeats soon.
const std::vector<double>& phase() {
  static const std::vector<double> record = [] {
    std::vector<double> walk(kPoints);
    std::uint64_t state = 1;
    double x = 0.0;
    for (double& value : walk) {
      state = state * 6364136223846793005U + 1442695040888963407U;  // Knuth's MMIX
      x += static_cast<double>(static_cast<std::int64_t>(state)) * 1e-28;
      value = x;
    }
    return walk;
  }();
  return record;
}

void deviation(benchmark::State& state, Deviation kind) {
  const auto factors = octave_factors(phase().size());
  for (auto _ : state) benchmark::DoNotOptimize(stability(kind, {phase(), 1.0}, factors));
}

void maximum_time_interval_error(benchmark::State& state) {
  const auto factors = octave_factors(phase().size());
  for (auto _ : state) benchmark::DoNotOptimize(mtie({phase(), 1.0}, factors));
}

template <class Accumulator>
void stream(benchmark::State& state) {
  Accumulator accumulator;
  std::size_t i = 0;
  for (auto _ : state) {
    accumulator.add(phase()[i]);
    i = i + 1 == kPoints ? 0 : i + 1;
  }
  benchmark::DoNotOptimize(accumulator);
}

BENCHMARK_CAPTURE(deviation, adev, Deviation::kAllan)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(deviation, oadev, Deviation::kOverlappingAllan)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(deviation, mdev, Deviation::kModifiedAllan)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(deviation, ohdev, Deviation::kOverlappingHadamard)->Unit(benchmark::kSecond);
BENCHMARK(maximum_time_interval_error)->Unit(benchmark::kSecond);
BENCHMARK_TEMPLATE(stream, RunningStatistics);
BENCHMARK_TEMPLATE(stream, QuantileSketch);

}  // namespace
}  // namespace ftcs

BENCHMARK_MAIN();
