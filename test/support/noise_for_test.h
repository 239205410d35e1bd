// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

namespace ftcs::test {

/// NIST SP 1065, 12.4: n <- 16807 n mod (2^31 - 1) from 1234567890, divided by 2^31 - 1; frequency
/// data.
inline std::vector<double> nist_frequency() {
  constexpr std::int64_t kModulus = 2147483647;
  std::vector<double> frequency;
  std::int64_t n = 1234567890;
  for (int i = 0; i < 1000; ++i) {
    frequency.push_back(static_cast<double>(n) / static_cast<double>(kModulus));
    n = 16807 * n % kModulus;
  }
  return frequency;
}

inline std::vector<double> white_noise(std::size_t count, double sigma, std::uint32_t seed) {
  boost::random::mt19937 generator(seed);
  boost::random::normal_distribution<double> normal(0.0, sigma);
  std::vector<double> series(count);
  for (double& value : series) value = normal(generator);
  return series;
}

/// Power spectrum 1/f by half-order integration of white noise (Kasdin & Walter 1992): weights h_0
/// = 1, h_k = h_(k-1) (k - 1/2)/k. One-sided density of the result sigma^2 / (pi f) well below the
/// sampling rate. The first half, where the filter still fills, is thrown away.
inline std::vector<double> flicker_noise(std::size_t count, double sigma, std::uint32_t seed) {
  const std::vector<double> white = white_noise(2 * count, sigma, seed);
  std::vector<double> weights(count, 1.0);
  for (std::size_t k = 1; k < count; ++k) {
    weights[k] = weights[k - 1] * (static_cast<double>(k) - 0.5) / static_cast<double>(k);
  }
  std::vector<double> series(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < count; ++k) series[i] += weights[k] * white[count + i - k];
  }
  return series;
}

inline std::vector<double> running_sum(std::vector<double> series) {
  for (std::size_t i = 1; i < series.size(); ++i) series[i] += series[i - 1];
  return series;
}

}  // namespace ftcs::test
