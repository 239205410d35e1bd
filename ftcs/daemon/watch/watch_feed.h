// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "ftcs/daemon/watch/watch_state.h"

namespace ftcs::daemon {

/// Values from one thread to another, of which the newest alone counts. The writer never waits,
/// whatever the reader does: three places, of which each has one and the third changes hands.
template <class Value>
class TripleBuffer {
 public:
  /// Writer.
  void write(const Value& value) noexcept {
    places_[writing_] = value;
    writing_ = shared_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kPlace;
  }
  /// Reader: the newest one.
  [[nodiscard]] const Value& read() noexcept {
    if ((shared_.load(std::memory_order_relaxed) & kFresh) != 0) {
      reading_ = shared_.exchange(reading_, std::memory_order_acq_rel) & kPlace;
    }
    return places_[reading_];
  }

 private:
  static constexpr unsigned kFresh = 4;
  static constexpr unsigned kPlace = 3;
  std::array<Value, 3> places_{};
  unsigned writing_ = 0;
  unsigned reading_ = 1;
  std::atomic<unsigned> shared_ = 2;
};

/// A queue from one thread to another. What does not fit is dropped and counted: the writer never
/// waits.
template <class Value, std::size_t Capacity>
class PointQueue {
 public:
  /// Writer.
  void push(const Value& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == Capacity) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    values_[head % Capacity] = value;
    head_.store(head + 1, std::memory_order_release);
  }
  /// Reader: takes the oldest; false: there is none.
  [[nodiscard]] bool pop(Value& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    value = values_[tail % Capacity];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return dropped_.load(std::memory_order_relaxed);
  }

 private:
  std::array<Value, Capacity> values_{};
  std::atomic<std::size_t> head_ = 0;
  std::atomic<std::size_t> tail_ = 0;
  std::atomic<std::uint64_t> dropped_ = 0;
};

/// What a loop tells those who watch it. It waits for nobody and touches no heap.
class WatchFeed {
 public:
  void add(const WatchPoint& point) noexcept { points_.push(point); }
  void publish(const WatchState& state) noexcept { state_.write(state); }

  // The one thread that watches.
  [[nodiscard]] const WatchState& state() noexcept { return state_.read(); }
  [[nodiscard]] bool next(WatchPoint& point) noexcept { return points_.pop(point); }

 private:
  static constexpr std::size_t kPoints = 8192;  // two seconds of a cycle of 250 us
  PointQueue<WatchPoint, kPoints> points_;
  TripleBuffer<WatchState> state_;
};

}  // namespace ftcs::daemon
