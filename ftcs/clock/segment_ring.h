// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include "ftcs/time/instant.h"

namespace ftcs {

/// The last `Capacity` segments of something that is piecewise defined over free-running time. A
/// segment holds from its start() to the start of its successor; the oldest one also stands for
/// everything before it. Starts are compared by their difference: correct as long as the ring spans
/// less than 146 years, wrap included.
template <class Segment, std::size_t Capacity>
class SegmentRing {
  static_assert(Capacity >= 2, "a command makes two segments");

 public:
  explicit SegmentRing(const Segment& first) noexcept { segments_[0] = first; }

  /// Appends a segment. Segments that would start at or after it have not come to pass and are
  /// dropped (a correction that is replaced before it expired; an oscillator that went backward).
  void append(const Segment& next) noexcept {
    while (size_ > 0 && newest(0).start() - next.start() >= Duration{}) --size_;
    if (size_ == Capacity) {
      oldest_ = (oldest_ + 1) % Capacity;
      --size_;
    }
    segments_[(oldest_ + size_) % Capacity] = next;
    ++size_;
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// The segment `age` places before the newest; age < size().
  [[nodiscard]] const Segment& newest(std::size_t age) const noexcept {
    return segments_[(oldest_ + size_ - 1 - age) % Capacity];
  }
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
