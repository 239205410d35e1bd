// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"

namespace ftcs::estimation {

/// Learnt density of the waits of one direction: a histogram in half octaves
/// from 1 ns to 16 ms; longer waits count as these.
///
/// It starts as an exponential of the mean wait that the fit has found.
/// Neighbouring cells that have seen too little share one density, the first of
/// them down to zero: short waits are even, since a message comes in the middle
/// of a frame as often as at its end.
class WaitDensity {
 public:
  /// Whether it holds waits of that mean: of longer ones too few would lie in any cell, and what
  /// has no mass has no density. Up to 67 ms.
  [[nodiscard]] static constexpr bool holds(double mean_wait_ns) noexcept {
    return mean_wait_ns < kMuch * kLongest;
  }
  /// Forgets what was learnt; mean_wait_ns above zero, and such that it holds them.
  void start(double mean_wait_ns) noexcept;
  /// A message that was late by nu > 0 ns and waited with the given
  /// probability.
  void learn(double nu, double waited) noexcept;
  /// 1/ns, of a wait of nu > 0 ns.
  [[nodiscard]] double at(double nu) const noexcept {
    return static_cast<double>(density_[cell_of(nu)]);
  }

 private:
  static constexpr std::size_t kCells = 48;
  static constexpr double kLongest = 1ULL << (kCells / 2);  ///< ns

  /// Two cells an octave; the exponent and the first bit of the mantissa of
  /// nu^2 tell which.
  [[nodiscard]] static std::size_t cell_of(double nu) noexcept {
    if (!(nu > 1.0)) return 0;
    const auto exponent = static_cast<std::size_t>(std::bit_cast<std::uint64_t>(nu * nu) >> 52U);
    const std::size_t cell = exponent - 1023U;
    return cell < kCells ? cell : kCells - 1;
  }
  void tabulate() noexcept;

  std::array<float, kCells> count_{};
  std::array<float, kCells> density_{};
  float mass_ = 0.0F;
  float untold_ = 0.0F;  ///< learnt since the table was made
};

}  // namespace ftcs::estimation
