// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/platform/kernel.h"
#include "ftcs/time/instant.h"

namespace ftcs::platform {

/// CLOCK_MONOTONIC as the free-running clock of a cyclic task, because it is the one that
/// clock_nanosleep() wakes by; and what a kernel stamp (CLOCK_REALTIME) is on it. Both are slewed
/// alike: only a step of CLOCK_REALTIME changes their difference, and follow_steps() finds it.
class HostClock {
 public:
  /// The kernel must outlive the clock.
  explicit HostClock(Kernel& kernel) noexcept : kernel_(&kernel) { refresh(); }
  [[nodiscard]] FreeRunningTime now() const noexcept;
  [[nodiscard]] FreeRunningTime from_realtime(std::int64_t realtime_ns) const noexcept {
    return FreeRunningTime::from_ns(realtime_ns - realtime_ahead_ns_);
  }
  /// Three readings: if CLOCK_REALTIME was set by more than a microsecond, the difference is
  /// measured again. For each frame, since the stamps of a second would hold the step else.
  void follow_steps() noexcept;
  /// Sleeps until `spin` before the instant and turns in a circle for the rest.
  void wait_until(FreeRunningTime instant, Nanoseconds spin) const noexcept;

 private:
  struct Bracket {
    std::int64_t ahead_ns = 0;  ///< CLOCK_REALTIME - CLOCK_MONOTONIC
    std::int64_t width_ns = 0;  ///< between the readings around
  };
  [[nodiscard]] Bracket read() const noexcept;
  /// Measures the difference: tightest of a few bracketed readings.
  void refresh() noexcept;

  Kernel* kernel_;
  std::int64_t realtime_ahead_ns_ = 0;
};

/// What a cyclic task asked of the system, and what it got.
struct RealtimeSetup {
  bool memory_locked = false;
  bool priority_set = false;
  bool pinned = false;
  bool latency_held = false;  ///< /dev/cpu_dma_latency is held at zero
};

/// SCHED_FIFO at `priority` (0: leave it), memory locked, pinned to `cpu` (-1: leave it), processor
/// sleep states held off as long as the program lives. Nothing is an error: what was refused is
/// false.
[[nodiscard]] RealtimeSetup make_realtime(int priority, int cpu) noexcept;
/// Back to the scheduler of everybody, for the thread that calls it.
void leave_realtime() noexcept;

}  // namespace ftcs::platform
