// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include "ftcs/time/instant.h"

namespace ftcs {

/// The last `Capacity` segments of something that is piecewise defined over free-running time.
///
/// Of the segments that have begun at an instant, the one appended last holds. So a new one also
/// takes the place of what was planned for later (a correction replaced before it expired). Before
/// all of them the oldest holds. Starts are compared by their difference: correct as long as the
/// ring spans less than 146 years, wrap included.
template <class Segment, std::size_t Capacity>
class SegmentRing {
 public:
  explicit SegmentRing(const Segment& first) noexcept { segments_[0] = first; }

  /// Appends a segment; the oldest one goes if the ring is full.
  void append(const Segment& next) noexcept {
    if (size_ < Capacity) {
      segments_[size_] = next;
      ++size_;
    } else {
      segments_[oldest_] = next;
      oldest_ = (oldest_ + 1) % Capacity;
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// The segment `age` places before the newest; age < size().
  [[nodiscard]] const Segment& newest(std::size_t age) const noexcept {
    return segments_[(oldest_ + size_ - 1 - age) % Capacity];
  }
  [[nodiscard]] Segment& newest() noexcept { return segments_[(oldest_ + size_ - 1) % Capacity]; }
  /// The segment that holds at an instant.
  [[nodiscard]] const Segment& at(FreeRunningTime instant) const noexcept {
    std::size_t age = 0;
    while (age + 1 < size_ && instant - newest(age).start() < Duration{}) ++age;
    return newest(age);
  }

 private:
  std::array<Segment, Capacity> segments_{};
  std::size_t oldest_ = 0;
  std::size_t size_ = 1;
};

}  // namespace ftcs
