// SPDX-License-Identifier: MIT
// ftcs_bench_steps: prints the names of the cases. ftcs_bench_steps NAME COUNT: does COUNT steps of
// one, to be counted from outside (bench/instructions.sh).
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <benchmark/benchmark.h>

#include "bench/cases.h"

int main(int argc, char** argv) {
  const bool list = argc == 1;
  if (!list && argc != 3) {
    std::fprintf(stderr, "usage: %s [NAME COUNT]\n", argv[0]);
    return 1;
  }
  const std::string_view wanted = list ? "" : argv[1];
  const long long count = list ? 0 : std::atoll(argv[2]);
  bool found = list;
  ftcs::bench::for_each_case([&]<class Case>(const char* name, std::type_identity<Case>) {
    if (list) std::puts(name);
    if (name != wanted) return;
    found = true;
    Case subject;
    for (long long i = 0; i < count; ++i) benchmark::DoNotOptimize(subject.step());
  });
  if (!found) std::fprintf(stderr, "%s: no case of that name\n", argv[1]);
  return found ? 0 : 1;
}
