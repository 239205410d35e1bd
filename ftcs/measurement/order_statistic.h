// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <utility>

namespace ftcs {

/// Standard deviation of a normal distribution in units of its median absolute deviation:
/// 1 / (quantile of 0.75).
inline constexpr double kMadToSigma = 1.4826;

/// The value that stood at `wanted`, were the first `size` of `values` sorted (Hoare's FIND, Comm.
/// ACM 4, 1961); they are reordered. In place of std::nth_element, which calls memmove: the cycle
/// servo's C library has but memcpy and memset. Valid: 0 <= wanted < size, and no value that is not
/// a number. With size = 0 and wanted = 0 the first element is returned as it is. Linear on
/// average, quadratic at worst.
template <class Values>
double order_statistic(Values& values, std::ptrdiff_t size, std::ptrdiff_t wanted) noexcept {
  const auto at = values.begin();
  std::ptrdiff_t left = 0;
  std::ptrdiff_t right = size - 1;
  while (left < right) {
    const double pivot = at[wanted];
    std::ptrdiff_t i = left;
    std::ptrdiff_t j = right;
    while (i <= j) {
      while (at[i] < pivot) ++i;
      while (pivot < at[j]) --j;
      if (i > j) break;
      std::swap(at[i], at[j]);
      ++i;
      --j;
    }
    if (j < wanted) left = i;
    if (wanted < i) right = j;
  }
  return at[wanted];
}

}  // namespace ftcs
