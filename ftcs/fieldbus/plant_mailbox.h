// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "ftcs/fieldbus/plant_line.h"

namespace ftcs::daemon {

/// The newest reading, from one thread to another without a lock: a sequence count that is odd
/// while the writer is at work. The reader never waits; a reading under way is taken in the next
/// cycle.
class PlantMailbox {
 public:
  void put(const PlantReading& reading) noexcept {
    const std::uint64_t count = count_.load(std::memory_order_relaxed);
    count_.store(count + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    instant_ns_.store(reading.instant.since_epoch().rounded_ns(), std::memory_order_relaxed);
    plant_ns_.store(reading.plant.since_epoch().rounded_ns(), std::memory_order_relaxed);
    count_.store(count + 2, std::memory_order_release);
  }
  /// None: nothing new since the last call.
  [[nodiscard]] std::optional<PlantReading> take() noexcept {
    const std::uint64_t count = count_.load(std::memory_order_acquire);
    if (count == taken_ || count % 2 != 0) return std::nullopt;
    const std::int64_t instant = instant_ns_.load(std::memory_order_relaxed);
    const std::int64_t plant = plant_ns_.load(std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_acquire);
    if (count_.load(std::memory_order_relaxed) != count) return std::nullopt;
    taken_ = count;
    return PlantReading{FreeRunningTime::from_ns(instant), ReferenceTime::from_ns(plant)};
  }

 private:
  std::atomic<std::uint64_t> count_{0};
  std::atomic<std::int64_t> instant_ns_{0};
  std::atomic<std::int64_t> plant_ns_{0};
  std::uint64_t taken_ = 0;  ///< the reader's
};

}  // namespace ftcs::daemon
