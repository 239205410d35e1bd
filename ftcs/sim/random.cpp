// SPDX-License-Identifier: MIT
#include "ftcs/sim/random.h"

#include <boost/random/exponential_distribution.hpp>
#include <boost/random/gamma_distribution.hpp>

namespace ftcs::sim {
namespace {

/// FNV-1a, 64 bit: turns a stream's name into a number.
std::uint64_t hash_name(std::string_view name) noexcept {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const char c : name) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001B3U;
  }
  return hash;
}

/// SplitMix64's finaliser: neighbouring seeds must not give neighbouring states.
std::uint64_t scramble(std::uint64_t x) noexcept {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31);
}

}  // namespace

RandomStream::RandomStream(std::uint64_t seed, std::string_view name, std::uint64_t index) noexcept
    : engine_(scramble(scramble(scramble(seed) ^ hash_name(name)) ^ index)) {}

double RandomStream::uniform() noexcept {
  constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
  return static_cast<double>(engine_() >> 11) * kUnit;
}

double RandomStream::exponential() {
  boost::random::exponential_distribution<double> distribution(1.0);
  return distribution(engine_);
}

double RandomStream::gamma(double shape) {
  boost::random::gamma_distribution<double> distribution(shape, 1.0);
  return distribution(engine_);
}

bool RandomStream::chance(double probability) noexcept {
  return probability > 0.0 && uniform() < probability;
}

}  // namespace ftcs::sim
