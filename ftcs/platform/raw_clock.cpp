// SPDX-License-Identifier: MIT
#include "ftcs/platform/raw_clock.h"

#include <cstdlib>
#include <limits>
#include <utility>

namespace ftcs::platform {
namespace {

// Interrupts disturb single brackets; the tightest of five is rarely one of them.
constexpr int kReadings = 5;
// The kernel slews by at most 500 ppm unless the tick is changed; twice that is taken for a step.
constexpr double kLargestSlew = 1000e-6;
// Shorter baselines would divide the width of a bracket by too little to be a useful rate.
constexpr std::int64_t kShortestBaselineNs = 10'000'000;
// What two readings may disagree by beyond their brackets (granularity of clocks and scheduling).
constexpr std::int64_t kReadingToleranceNs = 1'000;

// The kernel's rule for the id of a clock behind a file descriptor (man 2 clock_getres, dynamic
// clocks).
clockid_t clock_id_of(int fd) noexcept {
  constexpr unsigned kClockFd = 3;
  return static_cast<clockid_t>((~static_cast<unsigned>(fd) << 3) | kClockFd);
}

}  // namespace

HardwareClock::HardwareClock(Kernel& kernel, Descriptor device) noexcept
    : kernel_(kernel), device_(std::move(device)), clock_id_(clock_id_of(device_.get())) {}

RealtimeToRaw::RealtimeToRaw(Kernel& kernel) noexcept : kernel_(kernel), baseline_(read()) {}

RealtimeToRaw::Reading RealtimeToRaw::read() noexcept {
  Reading best{0, 0, std::numeric_limits<std::int64_t>::max()};
  for (int i = 0; i < kReadings; ++i) {
    const std::int64_t before = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
    const std::int64_t realtime = kernel_.clock_ns(CLOCK_REALTIME);
    const std::int64_t after = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
    if (after - before < best.width_ns) {
      best = {before + (after - before) / 2, realtime, after - before};
    }
  }
  return best;
}

void RealtimeToRaw::learn(const Reading& now) noexcept {
  const std::int64_t elapsed_raw = now.raw_ns - baseline_.raw_ns;
  const std::int64_t gained = (now.realtime_ns - baseline_.realtime_ns) - elapsed_raw;
  const auto allowed = static_cast<std::int64_t>(kLargestSlew * static_cast<double>(elapsed_raw)) +
                       now.width_ns + baseline_.width_ns + kReadingToleranceNs;
  if (std::abs(gained) > allowed) {
    ++steps_;
    slew_ = 0.0;
    trusted_since_ns_ = now.realtime_ns;
    baseline_ = now;
  } else if (elapsed_raw >= kShortestBaselineNs) {
    slew_ = static_cast<double>(gained) / static_cast<double>(elapsed_raw);
    baseline_ = now;
  }
}

Result<FreeRunningTime, MappingError> RealtimeToRaw::map(std::int64_t realtime_ns) noexcept {
  const Reading now = read();
  learn(now);
  const std::int64_t age = now.realtime_ns - realtime_ns;
  if (age < -(now.width_ns + kReadingToleranceNs)) return MappingError::kFromTheFuture;
  if (realtime_ns < trusted_since_ns_) return MappingError::kRealtimeStepped;
  // REALTIME ran at 1 + slew against RAW, so that its age is too long by that factor.
  const double excess = static_cast<double>(age) * slew_ / (1.0 + slew_);
  return FreeRunningTime::from_ns(now.raw_ns - age) + Duration::from_ns(excess);
}

}  // namespace ftcs::platform
