// SPDX-License-Identifier: MIT
#include "ftcs/platform/raw_clock.h"

#include <algorithm>
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
// A rate is learnt where the brackets leave no more than half of this in doubt: a preempted reading
// needs a long baseline.
constexpr double kLargestDoubt = 1000e-6;
// A baseline so much wider than a reading that it was interrupted.
constexpr std::int64_t kInterruptedNs = 5'000;
constexpr std::int64_t kUsualSpread = 4;
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

RealtimeToRaw::Gain RealtimeToRaw::gain_of(const Reading& now) const noexcept {
  Gain gain;
  gain.elapsed_ns = now.raw_ns - baseline_.raw_ns;
  gain.by_ns = (now.realtime_ns - baseline_.realtime_ns) - gain.elapsed_ns;
  gain.doubt_ns = now.width_ns + baseline_.width_ns;
  const double slewed = kLargestSlew * static_cast<double>(gain.elapsed_ns);
  gain.is_step = std::abs(gain.by_ns) >
                 static_cast<std::int64_t>(slewed) + gain.doubt_ns + kReadingToleranceNs;
  return gain;
}

// What looks like a step is looked at again; of two readings that agree the narrower one counts.
RealtimeToRaw::Reading RealtimeToRaw::read_confirmed() noexcept {
  const Reading now = read();
  if (!gain_of(now).is_step) return now;
  const Reading again = read();
  return gain_of(again).is_step && now.width_ns < again.width_ns ? now : again;
}

void RealtimeToRaw::learn(const Reading& now) noexcept {
  const Gain gain = gain_of(now);
  const auto elapsed = static_cast<double>(gain.elapsed_ns);
  if (gain.is_step) {
    ++steps_;
    slew_ = 0.0;
    trusted_since_ns_ = now.realtime_ns;
    baseline_ = now;
  } else if (gain.elapsed_ns >= kShortestBaselineNs &&
             static_cast<double>(gain.doubt_ns) <= kLargestDoubt * elapsed) {
    slew_ = static_cast<double>(gain.by_ns) / elapsed;
    baseline_ = now;
  } else if (baseline_.width_ns > std::max(kInterruptedNs, kUsualSpread * now.width_ns)) {
    baseline_ = now;
  }
}

Result<FreeRunningTime, MappingError> RealtimeToRaw::map(std::int64_t realtime_ns) noexcept {
  const Reading now = read_confirmed();
  learn(now);
  if (realtime_ns - now.realtime_ns > now.width_ns + kReadingToleranceNs) {
    return MappingError::kFromTheFuture;
  }
  if (realtime_ns < trusted_since_ns_) return MappingError::kRealtimeStepped;
  // A narrow reading of a while ago says more than a wide one of now.
  const double slewed = kLargestSlew * static_cast<double>(now.raw_ns - baseline_.raw_ns);
  const bool is_wide =
      static_cast<double>(now.width_ns) > static_cast<double>(baseline_.width_ns) + slewed;
  const Reading& by = is_wide ? baseline_ : now;
  // REALTIME ran at 1 + slew against RAW, so that its age is too long by that factor.
  const std::int64_t age = by.realtime_ns - realtime_ns;
  const double excess = static_cast<double>(age) * slew_ / (1.0 + slew_);
  return FreeRunningTime::from_ns(by.raw_ns - age) + Duration::from_ns(excess);
}

}  // namespace ftcs::platform
