// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace ftcs::ptp {

/// SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014): eight
/// octets of state, the same numbers on every machine. Good enough to spread Delay_Req messages;
/// not for secrets.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) noexcept : state_(seed) {}

  /// Uniform in [0, 1), 53 bits.
  constexpr double uniform() noexcept {
    constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
    return static_cast<double>(next() >> 11) * kUnit;
  }

 private:
  constexpr std::uint64_t next() noexcept {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace ftcs::ptp
