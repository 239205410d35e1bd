// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/time/per_direction.h"

namespace ftcs::estimation {

/// One message as it is kept for a fit.
struct RecordedMessage {
  double z = 0.0;          ///< ns, brought to the time below by the rate that was believed
  std::uint32_t time = 0;  ///< in 1 / RecordWindow::kUnitsPerCycle cycles, modulo 2^32
  float said = 0.0F;       ///< ln density that the filters gave it; 0: they were not there
};

/// The last messages of one direction, seen from `now`; k = 0 is the oldest.
struct RecordWindow {
  const RecordedMessage* ring = nullptr;
  std::size_t capacity = 0;
  std::size_t first = 0;
  std::size_t size = 0;
  std::uint32_t now = 0;

  [[nodiscard]] const RecordedMessage& operator[](std::size_t k) const noexcept {
    const std::size_t place = first + k;
    return ring[place < capacity ? place : place - capacity];
  }
  /// Cycles before `now`, negative.
  [[nodiscard]] double time(const RecordedMessage& message) const noexcept {
    return static_cast<double>(static_cast<std::int32_t>(message.time - now)) / kUnitsPerCycle;
  }
  [[nodiscard]] double oldest() const noexcept { return time((*this)[0]); }
  void drop_oldest() noexcept {
    first = first + 1 == capacity ? 0 : first + 1;
    --size;
  }
  /// 2^17: 32 bits hold eight of the longest gap.
  static constexpr double kUnitsPerCycle = 4294967296.0 / (8.0 * kLongestGap);
};

/// Keeps one of every `stride` messages of each direction: the first that the
/// filters believed at the floor of the delay, else the earliest by the
/// believed rate. The last Capacity of them.
template <std::size_t Capacity>
class FloorRecord {
 public:
  static constexpr std::size_t kCapacity = Capacity;
  struct Message {
    Direction direction = Direction::kForward;
    double z = 0.0;
    double said = 0.0;      ///< ln density by the filters, 0 without them
    bool at_floor = false;  ///< believed
    double rate = 0.0;      ///< believed, ns per cycle
  };

  void clear() noexcept {
    sides_ = {};
    cycles_ = 0.0;
    stride_ = 1;
  }
  /// Time passes, cycles. Beyond what the record can tell apart it starts anew.
  void elapse(double cycles) noexcept {
    if (!(std::abs(cycles) < kLongestGap))
      clear();
    else
      cycles_ += cycles;
  }
  /// At the present. True if an entry was completed.
  bool push(const Message& message) noexcept {
    Side& side = sides_[message.direction];
    const double rounded = std::floor(cycles_ * RecordWindow::kUnitsPerCycle);
    const double ahead = rounded / RecordWindow::kUnitsPerCycle - cycles_;
    const RecordedMessage entry{message.z + message.rate * ahead, now(),
                                static_cast<float>(message.said)};
    if (side.taken == 0) side.at_floor = false;
    // The first one at the floor: the earliest of several there would be early
    // by its noise.
    const bool better = !side.at_floor && (message.at_floor || earlier(entry, side.best, message));
    if (side.taken == 0 || better) side.best = entry;
    side.at_floor = side.at_floor || message.at_floor;
    if (++side.taken < stride_) return false;
    side.taken = 0;
    append(side, side.best);
    return true;
  }

  [[nodiscard]] std::size_t size(Direction direction) const noexcept {
    return sides_[direction].size;
  }
  [[nodiscard]] bool full() const noexcept {
    return std::min(sides_.forward.size, sides_.backward.size) == Capacity;
  }
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
  /// The last `wanted` entries of a direction, or all there are.
  [[nodiscard]] RecordWindow window(Direction direction, std::size_t wanted) const noexcept {
    const Side& side = sides_[direction];
    const std::size_t size = std::min<std::size_t>(wanted, side.size);
    const std::size_t first = (side.next + Capacity - size) % Capacity;
    return {side.ring.data(), Capacity, first, size, now()};
  }

  /// Of two neighbours the earlier stays; from now on twice as many messages
  /// make an entry.
  void coarsen(double rate) noexcept {
    for (const Direction direction : kDirections) {
      Side& side = sides_[direction];
      const RecordWindow all = window(direction, Capacity);
      const Message at{direction, 0.0, 0.0, false, rate};
      // In place: an entry is written at or before the place of the two it
      // stands for.
      const std::size_t kept = all.size / 2;
      for (std::size_t k = 0; k < kept; ++k) {
        const RecordedMessage& a = all[2 * k];
        const RecordedMessage& b = all[2 * k + 1];
        side.ring[(all.first + k) % Capacity] = earlier(a, b, at) ? a : b;
      }
      side.size = static_cast<std::uint8_t>(kept);
      side.next = static_cast<std::uint8_t>((all.first + kept) % Capacity);
      side.taken = 0;
    }
    stride_ = static_cast<std::uint8_t>(stride_ * 2U);
  }
  /// Half as many messages make an entry from now on.
  void refine() noexcept {
    if (stride_ > 1) stride_ = static_cast<std::uint8_t>(stride_ / 2U);
  }
  void shift_offset(double shift_ns) noexcept {
    for_each([shift_ns](RecordedMessage& entry) { entry.z += shift_ns; });
  }
  /// The unit of time becomes `factor` times as long.
  void rescale_time(double factor) noexcept {
    const std::uint32_t before = now();
    cycles_ /= factor;
    const std::uint32_t after = now();
    for_each([=](RecordedMessage& entry) {
      const double ago = static_cast<double>(static_cast<std::int32_t>(before - entry.time));
      entry.time = after - static_cast<std::uint32_t>(static_cast<std::int64_t>(ago / factor));
    });
  }
  /// What the filters say of each entry now: said(direction, cycles from now,
  /// z).
  template <class Said>
  void say(Said said) noexcept {
    for (const Direction direction : kDirections) {
      const RecordWindow all = window(direction, Capacity);
      Side& side = sides_[direction];
      for (std::size_t k = 0; k < side.size; ++k) {
        RecordedMessage& entry = side.ring[(all.first + k) % Capacity];
        entry.said = static_cast<float>(said(direction, all.time(entry), entry.z));
      }
    }
  }

 private:
  static_assert(Capacity <= 128);
  struct Side {
    std::array<RecordedMessage, Capacity> ring{};
    RecordedMessage best{};  ///< of the block that is under way
    std::uint8_t size = 0;
    std::uint8_t next = 0;
    std::uint8_t taken = 0;
    bool at_floor = false;
  };

  [[nodiscard]] std::uint32_t now() const noexcept {
    return static_cast<std::uint32_t>(
        static_cast<std::int64_t>(std::floor(cycles_ * RecordWindow::kUnitsPerCycle)));
  }
  static void append(Side& side, const RecordedMessage& entry) noexcept {
    side.ring[side.next] = entry;
    side.next = static_cast<std::uint8_t>(side.next + 1U == Capacity ? 0U : side.next + 1U);
    side.size = static_cast<std::uint8_t>(std::min<std::size_t>(side.size + 1U, Capacity));
  }
  /// Whether a came earlier than b at the rate in `by`.
  [[nodiscard]] static bool earlier(const RecordedMessage& a, const RecordedMessage& b,
                                    const Message& by) noexcept {
    const double between = static_cast<double>(static_cast<std::int32_t>(a.time - b.time)) /
                           RecordWindow::kUnitsPerCycle;
    return sign_of(by.direction) * (a.z - b.z - by.rate * between) < 0.0;
  }
  template <class Change>
  void for_each(Change change) noexcept {
    for (const Direction direction : kDirections) {
      for (RecordedMessage& entry : sides_[direction].ring) change(entry);
      change(sides_[direction].best);
    }
  }

  PerDirection<Side> sides_{};
  double cycles_ = 0.0;
  std::uint8_t stride_ = 1;
};

/// No fit reads more messages of a direction.
using LongestRecord = FloorRecord<128>;

}  // namespace ftcs::estimation
