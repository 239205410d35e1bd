// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ftcs::estimation {

/// The last `Capacity` values and the same values in order, so that a median
/// costs a look-up and a new value at most `Capacity` moves. Single precision:
/// it holds noise samples near zero.
template <std::size_t Capacity>
class SortedWindow {
 public:
  void push(double value) noexcept {
    const auto incoming = static_cast<float>(value);
    if (!std::isfinite(incoming)) return;
    std::size_t hole = size_;
    if (size_ == Capacity) {
      hole = position_of(arrival_[next_]);
    } else {
      ++size_;
    }
    while (hole > 0 && sorted_[hole - 1] > incoming) {
      sorted_[hole] = sorted_[hole - 1];
      --hole;
    }
    while (hole + 1 < size_ && sorted_[hole + 1] < incoming) {
      sorted_[hole] = sorted_[hole + 1];
      ++hole;
    }
    sorted_[hole] = incoming;
    arrival_[next_] = incoming;
    next_ = static_cast<std::uint8_t>(next_ + 1U == Capacity ? 0U : next_ + 1U);
  }
  void clear() noexcept { size_ = next_ = 0; }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool full() const noexcept { return size_ == Capacity; }
  /// Upper median. Valid: size() > 0.
  [[nodiscard]] double median() const noexcept { return static_cast<double>(sorted_[size_ / 2]); }

  /// Median distance from the median. Of the distances a_1 <= .. <= a_k on its left and b_1 <= ..
  /// <= b_k on its right the k smallest are the min(a_i, b_(k+1-i)) (Batcher's bitonic merge, AFIPS
  /// 32, 1968); wanted is the largest of these. Valid: size() > 0.
  [[nodiscard]] double median_deviation() const noexcept {
    const std::size_t middle = size_ / 2;
    const float centre = sorted_[middle];
    float distance = 0.0F;
    for (std::size_t i = 0; i < middle; ++i) {
      const std::size_t other = middle + 1U + i;  // the last one is not there if size is even
      const float left = centre - sorted_[i];
      const float nearer = other < size_ ? std::min(left, sorted_[other] - centre) : left;
      distance = std::max(distance, nearer);
    }
    return static_cast<double>(distance);
  }

 private:
  [[nodiscard]] std::size_t position_of(float value) const noexcept {
    std::size_t smaller = 0;  // counted, not sought: nothing here for a processor to guess
    for (std::size_t i = 0; i < size_; ++i) smaller += static_cast<std::size_t>(sorted_[i] < value);
    return smaller;
  }

  static_assert(Capacity >= 4 && Capacity < 256);
  float arrival_[Capacity] = {};
  float sorted_[Capacity] = {};
  std::uint8_t size_ = 0;
  std::uint8_t next_ = 0;
};

}  // namespace ftcs::estimation
