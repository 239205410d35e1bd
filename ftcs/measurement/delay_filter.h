// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/time/duration.h"

namespace ftcs {

enum class DelayFilterKind : std::uint8_t {
  kMovingMedian,   ///< robust against spikes of either sign; ptp4l's default
  kMovingMinimum,  ///< for queueing delays, which only ever add
};

struct DelayFilterConfig {
  DelayFilterKind kind = DelayFilterKind::kMovingMedian;
  std::size_t length =
      10;  ///< last values taken into account, 1 to DelayFilter::kCapacity; 1 = no filter
};

/// Moving median or minimum of the last `length` values. While fewer have come, of those. The
/// median of an even number of values is the mean of the middle two.
class DelayFilter {
 public:
  static constexpr std::size_t kCapacity = 32;

  constexpr explicit DelayFilter(DelayFilterConfig config) noexcept
      : kind_(config.kind), length_(std::clamp<std::size_t>(config.length, 1, kCapacity)) {}

  constexpr void add(Duration value) noexcept {
    values_[next_] = value;
    next_ = (next_ + 1) % length_;
    size_ = std::min(size_ + 1, length_);
    filtered_ = filter();
  }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  /// Zero as long as the filter is empty.
  [[nodiscard]] constexpr Duration value() const noexcept { return filtered_; }
  constexpr void reset() noexcept {
    next_ = size_ = 0;
    filtered_ = Duration{};
  }

 private:
  [[nodiscard]] constexpr Duration filter() const noexcept {
    std::array<Duration, kCapacity> sorted = values_;
    std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(size_));
    if (kind_ == DelayFilterKind::kMovingMinimum) return sorted[0];
    const Duration low = sorted[(size_ - 1) / 2];
    return low + (sorted[size_ / 2] - low).half();
  }

  DelayFilterKind kind_;
  std::size_t length_;
  std::array<Duration, kCapacity> values_{};
  std::size_t next_ = 0;
  std::size_t size_ = 0;
  Duration filtered_{};
};

}  // namespace ftcs
