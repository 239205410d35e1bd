// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "ftcs/sim/true_time.h"

namespace ftcs::sim {

/// What happens next in the simulated world. Events of one instant come out in the order they went
/// in, so that a run does not depend on how a heap breaks ties.
template <class Event>
class EventQueue {
 public:
  struct Entry {
    TrueTime time;
    std::uint64_t sequence;
    Event event;
  };

  void schedule(TrueTime time, Event event) {
    heap_.push_back({time, next_sequence_++, std::move(event)});
    std::push_heap(heap_.begin(), heap_.end(), later);
  }
  [[nodiscard]] bool empty() const noexcept { return heap_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return heap_.size(); }
  [[nodiscard]] TrueTime next_time() const noexcept { return heap_.front().time; }

  /// Earliest event; the queue must not be empty.
  [[nodiscard]] Entry pop() {
    std::pop_heap(heap_.begin(), heap_.end(), later);
    Entry entry = std::move(heap_.back());
    heap_.pop_back();
    return entry;
  }

 private:
  [[nodiscard]] static bool later(const Entry& a, const Entry& b) noexcept {
    if (a.time != b.time) return a.time > b.time;
    return a.sequence > b.sequence;
  }

  std::vector<Entry> heap_;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace ftcs::sim
