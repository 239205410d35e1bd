// SPDX-License-Identifier: MIT
// World: ten million points of white FM, four months at 1 Hz; every octave of tau. Processor time,
// so that other programs do not matter; the limits leave a factor of several on a core of 2020.
#include <cstdio>
#include <ctime>
#include <string>

#include <gtest/gtest.h>

#include "ftcs/analysis/mtie.h"
#include "ftcs/analysis/stability.h"
#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

constexpr std::size_t kPoints = 10000000;
constexpr double kLimitSeconds = 10.0;

const std::vector<double>& phase() {
  static const auto record = test::running_sum(test::white_noise(kPoints, 1e-9, 1));
  return record;
}

template <class Work>
double seconds_of(Work work) {
  const std::clock_t begin = std::clock();
  work();
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

TEST(Speed, of_each_deviation_at_ten_million_points_is_below_its_limit) {
  const auto factors = octave_factors(phase().size());
  for (const auto deviation :
       {Deviation::kAllan, Deviation::kOverlappingAllan, Deviation::kModifiedAllan,
        Deviation::kTime, Deviation::kOverlappingHadamard, Deviation::kTotal}) {
    std::vector<StabilityPoint> points;
    const double seconds = seconds_of([&] {
      points = stability(deviation, {phase(), 1.0}, factors);
    });
    RecordProperty(name(deviation), std::to_string(seconds));
    std::printf("%s: %.2f s for %zu taus\n", name(deviation), seconds, points.size());
    EXPECT_LT(seconds, kLimitSeconds) << name(deviation);
    EXPECT_GT(points.size(), 20U) << name(deviation);
  }
}

TEST(Speed, of_mtie_at_ten_million_points_is_below_its_limit) {
  const auto factors = octave_factors(phase().size());
  std::vector<MtiePoint> points;
  const double seconds = seconds_of([&] { points = mtie({phase(), 1.0}, factors); });
  std::printf("MTIE: %.2f s for %zu taus\n", seconds, points.size());
  EXPECT_LT(seconds, kLimitSeconds);
  EXPECT_EQ(points.size(), factors.size());
}

}  // namespace
}  // namespace ftcs
