// SPDX-License-Identifier: MIT
#include "ftcs/estimation/elementary.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

using quick::kLn2High, quick::kLn2Low, quick::kMantissa, quick::kRound, quick::kSqrtHalf;

constexpr double kExp[] = {1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800,
                           1.0 / 362880,     1.0 / 40320,     1.0 / 5040,     1.0 / 720,
                           1.0 / 120,        1.0 / 24,        1.0 / 6,        1.0 / 2};
constexpr double kArtanh[] = {2.0 / 23, 2.0 / 21, 2.0 / 19, 2.0 / 17, 2.0 / 15, 2.0 / 13,
                              2.0 / 11, 2.0 / 9,  2.0 / 7,  2.0 / 5,  2.0 / 3};

// Highest power first.
constexpr double kTail[][4] = {
    {3.197926671666804e-08, -1.9551358868985616e-09, -2.623107347133476e-09, 0.0},
    {1.7419821586224816e-06, -5.084465378687302e-08, -2.4857126248016745e-07,
     1.879082322370048e-08},
    {5.164652974177416e-05, 2.2387565714911816e-05, -1.1438048033346894e-05,
     -9.792625707303523e-07},
    {-0.009746579683265262, 0.0017556261651970652, 0.000293714378044958, -0.00029015535246077655},
    {-0.10880393014244462, 0.09230432116428125, -0.05869339857664934, 0.02836227737211114},
    {1.2375126308378275, -0.14024059858554525, 0.0035854154854790257, 0.08227673848999506}};

template <std::size_t N>
double polynomial(const double (&coefficients)[N], double x) noexcept {
  double sum = 0.0;
  for (const double c : coefficients) sum = sum * x + c;
  return sum;
}

double power_of_two(std::int64_t n) noexcept {
  return std::bit_cast<double>(static_cast<std::uint64_t>(n + 1023) << 52U);
}

}  // namespace

double portable_exp(double x) noexcept {
  if (x > 710.0) return std::numeric_limits<double>::infinity();
  if (x < -746.0) return 0.0;
  if (x != x) return x;
  const double n = (x * (1.0 / std::numbers::ln2) + kRound) - kRound;
  const double high = x - n * kLn2High;
  const double low = n * kLn2Low;
  const double r = high - low;
  const double rest = (high - r) - low;
  const double e = 1.0 + (r + (rest + r * r * polynomial(kExp, r)));
  // In two steps: 2^n alone may lie beyond a double where e^x does not.
  const auto whole = static_cast<std::int64_t>(n);
  return e * power_of_two(whole / 2) * power_of_two(whole - whole / 2);
}

double portable_log(double x) noexcept {
  if (x <= 0.0) return -std::numeric_limits<double>::infinity();
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x) - kSqrtHalf;
  const auto exponent = static_cast<double>(static_cast<std::int64_t>(bits) >> 52);
  const double f = std::bit_cast<double>((bits & kMantissa) + kSqrtHalf) - 1.0;
  const double t = f / (2.0 + f);
  const double rest = ((f - 2.0 * t) - t * f) / (2.0 + f);  // what the quotient was rounded by
  const double u = t * t;
  const double tail = 2.0 * rest + t * u * polynomial(kArtanh, u);
  return exponent * kLn2High + (2.0 * t + (tail + exponent * kLn2Low));
}

double scaled_erfc(double x) noexcept {
  const double y = (x - 3.75) / (x + 3.75);
  const double y2 = y * y;
  const double y4 = y2 * y2;
  // Four chains side by side: a processor need not wait for each sum.
  double sum[4] = {};
  for (const auto& row : kTail) {
    for (std::size_t i = 0; i < 4; ++i) sum[i] = sum[i] * y4 + row[i];
  }
  return ((sum[0] + y2 * sum[2]) + y * (sum[1] + y2 * sum[3])) / (1.0 + 2.0 * x);
}

}  // namespace ftcs::estimation
