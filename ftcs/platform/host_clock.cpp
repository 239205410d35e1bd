// SPDX-License-Identifier: MIT
#include "ftcs/platform/host_clock.h"

#include <ctime>
#include <fcntl.h>
#include <limits>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

namespace ftcs::platform {

namespace {
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

std::int64_t read_ns(clockid_t clock) noexcept {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<std::int64_t>(time.tv_sec) * kNsPerSecond + time.tv_nsec;
}
}  // namespace

FreeRunningTime HostClock::now() noexcept {
  return FreeRunningTime::from_ns(read_ns(CLOCK_MONOTONIC));
}

void HostClock::refresh() noexcept {
  constexpr int kReadings = 7;
  std::int64_t best_width = std::numeric_limits<std::int64_t>::max();
  std::int64_t best = realtime_ahead_ns_;
  for (int i = 0; i < kReadings; ++i) {
    const std::int64_t before = read_ns(CLOCK_MONOTONIC);
    const std::int64_t realtime = read_ns(CLOCK_REALTIME);
    const std::int64_t width = read_ns(CLOCK_MONOTONIC) - before;
    if (width >= best_width) continue;
    best_width = width;
    best = realtime - (before + width / 2);
  }
  // The difference is constant but for steps: small changes are the brackets' own width.
  constexpr std::int64_t kStep = 1000;
  const std::int64_t change = best - realtime_ahead_ns_;
  if (known_ && change < kStep && change > -kStep) return;
  realtime_ahead_ns_ = best;
  known_ = true;
}

void HostClock::wait_until(FreeRunningTime instant, Nanoseconds spin) noexcept {
  const std::int64_t until = (instant - Duration{spin}).since_epoch().floor_ns();
  const timespec time{.tv_sec = until / kNsPerSecond, .tv_nsec = until % kNsPerSecond};
  if (read_ns(CLOCK_MONOTONIC) < until) {
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr);
  }
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
