// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/measurement/steady_mean.h"
#include "ftcs/time/duration.h"

namespace ftcs {

/// What is made of the last delays; ptp4l's delay_filter has the first one and a mean.
enum class DelayFilterKind : std::uint8_t {
  kMovingMedian,   ///< robust against spikes of either sign; ptp4l's default
  kMovingMinimum,  ///< for queueing delays, which only ever add
  kSteadyMean,     ///< for delays that are constant for hours: SteadyMean
};

struct DelayFilterConfig {
  DelayFilterKind kind = DelayFilterKind::kMovingMedian;
  /// Last values taken into account, 1 to DelayFilter::kCapacity; 1 = no filter. Steady mean: those
  /// whose median it starts from, at least SteadyMean::kFewest.
  std::size_t length = 10;
};

/// Moving median or minimum of the last `length` values. While fewer have come, of those. The
/// median of an even number of values is the mean of the middle two. The steady mean is their
/// median until all have come, and starts again from the newest that contradict it.
///
/// A median of n follows a true step after n / 2 values and bears nearly as many outliers; a
/// minimum follows a shorter path at once and a longer one after n; a steady mean goes on improving
/// for a thousand values, and follows a large step after four to ten (ShiftWatch). add() sorts at
/// most kCapacity values; no value is refused here.
class DelayFilter {
 public:
  static constexpr std::size_t kCapacity = 32;

  /// A length out of range is pulled to the nearest one in it.
  constexpr explicit DelayFilter(DelayFilterConfig config) noexcept
      : kind_(config.kind),
        length_(std::clamp<std::size_t>(
            config.length, config.kind == DelayFilterKind::kSteadyMean ? SteadyMean::kFewest : 1,
            kCapacity)) {}

  /// The newest value; value() has heard it afterwards.
  constexpr void add(Duration value) noexcept {
    values_[next_] = value;
    next_ = (next_ + 1) % length_;
    size_ = std::min(size_ + 1, length_);
    filtered_ = kind_ == DelayFilterKind::kSteadyMean ? steady(value) : filter();
  }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  /// Zero as long as the filter is empty.
  [[nodiscard]] constexpr Duration value() const noexcept { return filtered_; }
  constexpr void reset() noexcept {
    next_ = size_ = 0;
    filtered_ = Duration{};
    steady_ = {};
  }

 private:
  using Values = std::array<Duration, kCapacity>;

  [[nodiscard]] constexpr Duration filter() const noexcept {
    Values values = values_;
    if (kind_ != DelayFilterKind::kMovingMinimum) return median(values, size_);
    return *std::min_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(size_));
  }
  [[nodiscard]] constexpr Duration steady(Duration value) noexcept {
    if (size_ < length_) return filter();
    const int contradicting = steady_.started() ? steady_.add(value.ns()) : ShiftWatch::kLongestRun;
    if (contradicting > 0) start_steady(std::min(static_cast<std::size_t>(contradicting), length_));
    return Duration::from_ns(steady_.value());
  }
  constexpr void start_steady(std::size_t newest) noexcept {
    Values values{};
    for (std::size_t i = 0; i < newest; ++i) {
      values[i] = values_[(next_ + length_ - 1 - i) % length_];
    }
    const Duration centre = median(values, newest);
    for (std::size_t i = 0; i < newest; ++i) values[i] = abs(values[i] - centre);
    steady_.start(centre.ns(), median(values, newest).ns(), static_cast<double>(newest));
  }
  /// Of the first `size`, which are reordered.
  [[nodiscard]] static constexpr Duration median(Values& values, std::size_t size) noexcept {
    std::sort(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(size));
    const Duration low = values[(size - 1) / 2];
    return low + (values[size / 2] - low).half();
  }

  DelayFilterKind kind_;
  std::size_t length_;
  Values values_{};
  std::size_t next_ = 0;
  std::size_t size_ = 0;
  Duration filtered_{};
  SteadyMean steady_;
};

}  // namespace ftcs
