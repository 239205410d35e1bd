// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>

namespace ftcs {

/// Sum of squares of what is present.
struct MeanSquare {
  double sum = 0.0;
  std::size_t terms = 0;

  void add(double value) noexcept {
    if (value != value) return;  // a gap
    sum += value * value;
    ++terms;
  }
  [[nodiscard]] double mean() const noexcept { return sum / static_cast<double>(terms); }
};

/// From one stretch to the next: 1, or m/16 where all would cost too much.
[[nodiscard]] std::size_t stretch_stride(std::size_t values, std::size_t m) noexcept;

/// The core of MTOT and HTOT (D. A. Howe, F. Vernotte, "Generalization of the Total Variance
/// Approach to the Modified Allan Variance", PTTI 1999; NIST SP 1065, 5.2). Each stretch of 3m
/// values has the slope between the means of its halves taken off, is continued by its mirror image
/// to 9m values, and gives 6m second differences of means of m values; one term is the root of the
/// mean of their squares. A stretch with a gap gives none.
[[nodiscard]] MeanSquare total_of_stretches(std::span<const double> values, std::size_t m);

}  // namespace ftcs
