// SPDX-License-Identifier: MIT
#include "ftcs/estimation/elementary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

// Units in the last place of `exact`.
double units(double value, long double exact) {
  int exponent = 0;
  static_cast<void>(std::frexp(static_cast<double>(exact), &exponent));
  const long double unit = std::ldexp(1.0L, std::max(exponent - 53, -1074));
  return static_cast<double>(std::abs((static_cast<long double>(value) - exact) / unit));
}

template <class Mine, class Exact>
double most_units(double from, double to, Mine&& mine, Exact&& exact) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(from, to);
  double most = 0.0;
  for (int n = 0; n < 300'000; ++n) {
    const double x = uniform(random);
    most = std::max(most, units(mine(x), exact(static_cast<long double>(x))));
  }
  return most;
}

TEST(PortableExp, is_within_a_unit_in_the_last_place) {
  const auto exact = [](long double x) { return std::exp(x); };
  for (const double reach : {1e-9, 0.3, 1.0, 40.0, 744.0}) {
    const double most = most_units(-reach, std::min(reach, 709.7), portable_exp, exact);
    std::printf("exp to +-%g: %.3f units\n", reach, most);
    EXPECT_LT(most, 1.0) << reach;
  }
}

TEST(PortableExp, ends_where_doubles_end) {
  EXPECT_EQ(portable_exp(0.0), 1.0);
  EXPECT_EQ(portable_exp(1e4), std::numeric_limits<double>::infinity());
  EXPECT_EQ(portable_exp(709.9), std::numeric_limits<double>::infinity());
  EXPECT_EQ(portable_exp(-1e4), 0.0);
  EXPECT_EQ(portable_exp(-745.9), 0.0);
  EXPECT_TRUE(std::isnan(portable_exp(std::numeric_limits<double>::quiet_NaN())));
}

TEST(PortableLog, is_within_a_unit_in_the_last_place) {
  const auto exact = [](long double x) { return std::log(x); };
  struct Range {
    double from, to;
  };
  for (const Range r : {Range{1e-300, 1e-290}, Range{1e-9, 1e-3}, Range{0.4, 2.5},
                        Range{0.999, 1.001}, Range{1.0, 1e6}, Range{1e200, 1e308}}) {
    const double most = most_units(r.from, r.to, portable_log, exact);
    std::printf("log from %g to %g: %.3f units\n", r.from, r.to, most);
    EXPECT_LT(most, 1.0) << r.from;
  }
  EXPECT_EQ(portable_log(1.0), 0.0);
  EXPECT_EQ(portable_log(0.0), -std::numeric_limits<double>::infinity());
}

TEST(ScaledErfc, is_within_seven_units_in_the_last_place) {
  const auto exact = [](long double x) { return std::exp(x * x) * std::erfc(x); };
  for (const double reach : {1e-6, 0.5, 2.0, 8.0, 100.0}) {
    const double most = most_units(0.0, reach, scaled_erfc, [&](long double x) {
      if (x < 20.0L) return exact(x);
      const long double v = 1.0L / (2.0L * x * x);  // the asymptotic series, to 2^-64
      long double sum = 1.0L;
      for (int k = 15; k > 0; --k) sum = 1.0L - static_cast<long double>(2 * k - 1) * v * sum;
      return sum / (x * std::sqrt(3.14159265358979323846264338L));
    });
    std::printf("scaled erfc to %g: %.3f units\n", reach, most);
    EXPECT_LT(most, 7.0) << reach;
  }
  EXPECT_EQ(scaled_erfc(0.0), 1.0);
}

TEST(EvenSpread, any_values_in_a_row_are_spread_evenly) {
  for (const std::uint32_t from : {0U, 1000U, 4'294'967'290U}) {  // the last runs over the end
    std::vector<double> values;
    for (std::uint32_t i = 0; i < 34; ++i) values.push_back(even_spread(from + i));
    std::sort(values.begin(), values.end());
    EXPECT_GE(values.front(), -0.5);
    EXPECT_LT(values.back(), 0.5);
    for (std::size_t i = 1; i < values.size(); ++i) EXPECT_LT(values[i] - values[i - 1], 0.035);
  }
}

}  // namespace
}  // namespace ftcs::estimation
