// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

namespace ftcs::sim {

/// One independent sequence of random numbers, named by what it is used for.
///
/// Every use has a stream of its own, so that two servos on one scenario meet the same packets and
/// the same oscillator whatever they do ("common random numbers"). Boost.Random, because its output
/// is fixed by its version; the standard library's distributions are not specified. One draw a
/// statement, never two in one expression: the order of evaluation differs between compilers.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view name, std::uint64_t index = 0) noexcept;

  /// [0, 1).
  [[nodiscard]] double uniform() noexcept;
  /// Standard normal.
  [[nodiscard]] double normal() { return normal_(engine_); }
  /// Exponential with mean 1.
  [[nodiscard]] double exponential();
  /// Gamma with the given shape (> 0) and scale 1.
  [[nodiscard]] double gamma(double shape);
  /// True with the given probability; draws nothing for probabilities of 0 and less.
  [[nodiscard]] bool chance(double probability) noexcept;

 private:
  boost::random::mt19937_64 engine_;
  boost::random::normal_distribution<double> normal_;
};

}  // namespace ftcs::sim
