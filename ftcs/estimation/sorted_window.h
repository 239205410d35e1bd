// SPDX-License-Identifier: MIT
#pragma once

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

  /// Median distance from the median: the two runs left and right of the median
  /// are merged from the inside outwards. Valid: size() > 0.
  [[nodiscard]] double median_deviation() const noexcept {
    const float centre = sorted_[size_ / 2];
    std::size_t left = size_ / 2;       // next candidate on the left is left - 1
    std::size_t right = size_ / 2 + 1;  // next candidate on the right
    float distance = 0.0F;
    for (std::size_t taken = 1; taken <= size_ / 2; ++taken) {
      const bool take_left =
          right >= size_ || (left > 0 && centre - sorted_[left - 1] < sorted_[right] - centre);
      distance = take_left ? centre - sorted_[--left] : sorted_[right++] - centre;
    }
    return static_cast<double>(distance);
  }

 private:
  [[nodiscard]] std::size_t position_of(float value) const noexcept {
    std::size_t low = 0;
    std::size_t high = size_;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (sorted_[middle] < value) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  static_assert(Capacity >= 4 && Capacity < 256);
  float arrival_[Capacity] = {};
  float sorted_[Capacity] = {};
  std::uint8_t size_ = 0;
  std::uint8_t next_ = 0;
};

}  // namespace ftcs::estimation
