// SPDX-License-Identifier: MIT
// World: MTIE against its definition, window by window, and against figures of an independent
// program.
#include "ftcs/analysis/mtie.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "ftcs/analysis/statistics.h"
#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

double by_definition(std::span<const double> x, std::size_t n) {
  double peak = 0.0;
  for (std::size_t k = 0; k + n < x.size(); ++k) {
    for (std::size_t i = k; i <= k + n; ++i) {
      for (std::size_t j = k; j <= k + n; ++j) peak = std::fmax(peak, x[i] - x[j]);
    }
  }
  return peak;
}

// allantools 2024.06 mtie() on the generator of NIST SP 1065, 12.4, started from 1234567, with its
// mean frequency removed; as published in the tests of the Rust library kshana 0.25
// (mtie_reference.rs).
TEST(Mtie, equals_the_figures_of_an_independent_program) {
  std::vector<double> frequency;
  std::int64_t n = 1234567;
  for (int i = 0; i < 1000; ++i) {
    n = 16807 * n % 2147483647;
    frequency.push_back(static_cast<double>(n) / 2147483647.0);
  }
  const double mean = std::accumulate(frequency.begin(), frequency.end(), 0.0) / 1000.0;
  for (double& y : frequency) y -= mean;
  const auto phase = phase_from_frequency(frequency, 1.0);
  const double expected[] = {5.039331146501622e-01, 9.966861362488411e-01, 1.746478854361213e+00,
                             2.560421549111802e+00, 4.027828642314221e+00, 5.175346023216539e+00,
                             6.949277421656195e+00, 1.123276896864584e+01, 1.258804496420642e+01};
  const std::size_t factors[] = {1, 2, 4, 8, 16, 32, 64, 128, 256};
  const auto points = mtie({phase, 1.0}, factors);
  ASSERT_EQ(points.size(), 9U);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(points[i].mtie_s, expected[i], 1e-9);
}

// 2,000 records of white phase noise against the distribution of the windows themselves: the share
// that is promised for a confidence of 90 % must be below the record's MTIE in at least 90 % of the
// records (87 %: four deviations of the count below), and not in nearly all of them.
TEST(Mtie, the_covered_share_keeps_its_confidence) {
  constexpr std::size_t kWindow = 7;
  const std::size_t factors[] = {kWindow};
  std::vector<double> ranges;
  const auto many = test::white_noise(400'000, 1.0, 1);
  for (std::size_t i = 0; i + kWindow < many.size(); i += kWindow + 1) {
    const auto [least, most] =
        std::minmax_element(many.begin() + static_cast<std::ptrdiff_t>(i),
                            many.begin() + static_cast<std::ptrdiff_t>(i + kWindow + 1));
    ranges.push_back(*most - *least);
  }
  std::sort(ranges.begin(), ranges.end());
  int kept = 0;
  for (std::uint32_t seed = 2; seed < 2002; ++seed) {
    const auto points = mtie({test::white_noise(80, 1.0, seed), 1.0}, factors, 0.9);
    const double below = static_cast<double>(
        std::lower_bound(ranges.begin(), ranges.end(), points.at(0).mtie_s) - ranges.begin());
    kept += below >= points[0].covered_share * static_cast<double>(ranges.size()) ? 1 : 0;
    EXPECT_NEAR(points[0].covered_share, std::pow(0.1, 0.1), 1e-12);  // ten windows side by side
  }
  EXPECT_GT(kept, 1740);
  EXPECT_LT(kept, 1990);
}

TEST(Mtie, equals_its_definition_at_every_window_length) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const auto x = test::running_sum(test::white_noise(37 + seed, 1.0, seed));
    for (std::size_t n = 1; n < x.size(); ++n) {
      const std::size_t factors[] = {n};
      const auto points = mtie({x, 0.5}, factors);
      ASSERT_EQ(points.size(), 1U);
      EXPECT_DOUBLE_EQ(points[0].mtie_s, by_definition(x, n)) << "seed " << seed << " n " << n;
      EXPECT_EQ(points[0].windows, x.size() - n);
      EXPECT_EQ(points[0].tau_s, 0.5 * static_cast<double>(n));
    }
  }
}

TEST(Mtie, leaves_missing_points_out_of_their_windows) {
  auto x = test::running_sum(test::white_noise(60, 1.0, 4));
  for (const std::size_t gap : {0U, 7U, 8U, 9U, 30U, 59U}) x[gap] = kNoFigure;
  for (std::size_t n = 1; n < x.size(); ++n) {
    const std::size_t factors[] = {n};
    EXPECT_DOUBLE_EQ(mtie({x, 1.0}, factors)[0].mtie_s, by_definition(x, n));
  }
}

TEST(Mtie, of_a_frequency_offset_grows_with_the_window) {
  std::vector<double> x(100);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1e-6 * static_cast<double>(i);
  const std::size_t factors[] = {10, 99};
  const auto points = mtie({x, 1.0}, factors);
  EXPECT_NEAR(points[0].mtie_s, 1e-5, 1e-15);
  EXPECT_NEAR(points[1].mtie_s, 9.9e-5, 1e-15);
}

TEST(Mtie, leaves_out_windows_longer_than_the_record) {
  const double x[] = {0.0, 1.0, 0.5};
  const std::size_t factors[] = {0, 2, 3};
  EXPECT_EQ(mtie({x, 1.0}, factors).size(), 1U);
  EXPECT_TRUE(mtie({{}, 1.0}, factors).empty());
}

}  // namespace
}  // namespace ftcs
