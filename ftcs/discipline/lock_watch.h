// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>

namespace ftcs {

/// Counts, cycle by cycle, how a lock comes and goes. Real-time safe.
class LockWatch {
 public:
  enum class Change : std::uint8_t { kNone, kLocked, kLost };

  /// Once in a cycle. Says what has changed since the last one.
  Change update(bool locked) noexcept {
    ++cycles_;
    if (locked == locked_) return Change::kNone;
    locked_ = locked;
    if (!locked) {
      ++losses_;
      lost_at_ = cycles_;
      return Change::kLost;
    }
    if (losses_ > 0) longest_relock_ = std::max(longest_relock_, cycles_ - lost_at_);
    return Change::kLocked;
  }

  [[nodiscard]] std::uint64_t losses() const noexcept { return losses_; }
  /// Most cycles from the loss of a lock to the next one.
  [[nodiscard]] std::uint64_t longest_relock() const noexcept { return longest_relock_; }
  /// Cycles since the lock was lost; 0 while there is one, and before the first.
  [[nodiscard]] std::uint64_t without() const noexcept {
    return locked_ || losses_ == 0 ? 0 : cycles_ - lost_at_ + 1;
  }

 private:
  bool locked_ = false;
  std::uint64_t cycles_ = 0;
  std::uint64_t losses_ = 0;
  std::uint64_t lost_at_ = 0;
  std::uint64_t longest_relock_ = 0;
};

}  // namespace ftcs
