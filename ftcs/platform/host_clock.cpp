// SPDX-License-Identifier: MIT
#include "ftcs/platform/host_clock.h"

#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

namespace ftcs::platform {

FreeRunningTime HostClock::now() const noexcept {
  return FreeRunningTime::from_ns(kernel_->clock_ns(CLOCK_MONOTONIC));
}

HostClock::Bracket HostClock::read() const noexcept {
  const std::int64_t before = kernel_->clock_ns(CLOCK_MONOTONIC);
  const std::int64_t realtime = kernel_->clock_ns(CLOCK_REALTIME);
  const std::int64_t width = kernel_->clock_ns(CLOCK_MONOTONIC) - before;
  return {realtime - (before + width / 2), width};
}

void HostClock::refresh() noexcept {
  constexpr int kReadings = 7;
  Bracket best = read();
  for (int i = 1; i < kReadings; ++i) {
    const Bracket next = read();
    if (next.width_ns < best.width_ns) best = next;
  }
  realtime_ahead_ns_ = best.ahead_ns;
}

void HostClock::follow_steps() noexcept {
  constexpr std::int64_t kStep = 1000;  // smaller ones are the brackets' own width
  const Bracket now = read();
  if (std::abs(now.ahead_ns - realtime_ahead_ns_) > kStep + now.width_ns / 2) refresh();
}

void HostClock::wait_until(FreeRunningTime instant, Nanoseconds spin) const noexcept {
  const std::int64_t until = (instant - Duration{spin}).since_epoch().floor_ns();
  if (kernel_->clock_ns(CLOCK_MONOTONIC) < until) kernel_->sleep_until(until);
  while (spin > Nanoseconds{0} && now() < instant) {
  }
}

RealtimeSetup make_realtime(int priority, int cpu) noexcept {
  RealtimeSetup result;
  result.memory_locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  if (cpu >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<unsigned>(cpu), &set);
    result.pinned = sched_setaffinity(0, sizeof set, &set) == 0;
  }
  if (priority > 0) {
    const sched_param parameter{.sched_priority = priority};
    result.priority_set = sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
  }
  // The request holds as long as the descriptor stays open: it is never closed.
  const int fd = ::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t none = 0;
  if (fd >= 0) result.latency_held = write(fd, &none, sizeof none) == sizeof none;
  return result;
}

void leave_realtime() noexcept {
  const sched_param parameter{.sched_priority = 0};
  static_cast<void>(sched_setscheduler(0, SCHED_OTHER, &parameter));
}

}  // namespace ftcs::platform
