// SPDX-License-Identifier: MIT
// Nanoseconds per servo update, clock command and message decoded. Goals on one core of a PC:
// ftcs_update 25 ns, decode_* 100 ns; one cycle of eight EtherCAT drives 3 us, its echo apart.
#include <benchmark/benchmark.h>

#include "bench/cases.h"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  ftcs::bench::for_each_case([]<class Case>(const char* name, std::type_identity<Case>) {
    benchmark::RegisterBenchmark(name, [](benchmark::State& state) {
      Case subject;
      for (auto _ : state) benchmark::DoNotOptimize(subject.step());
    });
  });
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
