// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/servo/converged_band.h"

namespace ftcs {

/// When a clock counts as locked. The defaults suit a network with stamps of the kernel; a cycle
/// has its own (CycleServoConfig::lock).
struct LockConfig {
  /// Locked below `enter`, lost at or above `leave`.
  ConvergedBand band{Nanoseconds{10'000}, Nanoseconds{100'000}};
  /// Consecutive samples below `enter` before the clock counts as locked: one may be chance.
  std::uint32_t dwell = 4;
};

/// Tells health, not control: nothing steers by it. Judges the perceived offset.
class LockDetector {
 public:
  explicit LockDetector(const LockConfig& config = {}) noexcept : config_(config) {}

  /// The next offset, local minus reference; true while locked.
  bool update(Duration offset) noexcept {
    return latch_.update(offset.ns(), config_.band, config_.dwell);
  }
  [[nodiscard]] bool locked() const noexcept { return latch_.closed(); }
  /// Not locked; the next lock takes all of the dwell again.
  void reset() noexcept { latch_ = ConvergenceLatch{}; }

 private:
  LockConfig config_;
  ConvergenceLatch latch_{};
};

}  // namespace ftcs
