// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// CLOCK_MONOTONIC_RAW: the machine's oscillator, which nobody steers. Its epoch is arbitrary.
class RawClock final : public FreeRunningSource {
 public:
  explicit RawClock(Kernel& kernel) noexcept : kernel_(kernel) {}
  [[nodiscard]] FreeRunningTime now() noexcept override {
    return FreeRunningTime::from_ns(kernel_.clock_ns(CLOCK_MONOTONIC_RAW));
  }

 private:
  Kernel& kernel_;
};

/// A PTP hardware clock (/dev/ptpN) that is read and never steered, so that it runs freely.
/// Hardware timestamps are readings of this clock and need no mapping.
class HardwareClock final : public FreeRunningSource {
 public:
  HardwareClock(Kernel& kernel, Descriptor device) noexcept;
  [[nodiscard]] FreeRunningTime now() noexcept override {
    return FreeRunningTime::from_ns(kernel_.clock_ns(clock_id_));
  }

 private:
  Kernel& kernel_;
  Descriptor device_;
  clockid_t clock_id_;
};

enum class MappingError : std::uint8_t {
  kRealtimeStepped,  ///< CLOCK_REALTIME was set between the stamp and now: it cannot be mapped
  kFromTheFuture,    ///< the stamp is newer than the clock it was taken from
};

/// Maps the kernel's software timestamps, which are readings of CLOCK_REALTIME, to
/// CLOCK_MONOTONIC_RAW.
///
/// Each mapping takes its own bracketed readings RAW, REALTIME, RAW and keeps the tightest of
/// several, because the kernel slews REALTIME against RAW all the time: with y the fractional slew,
/// a reading that is a old is wrong by a y. The rate between two mappings corrects for the age of
/// the stamp. A change of the difference that no slew and no width of a reading explains, twice, is
/// a step: stamps from before it are refused, later ones are good again. Where every reading was
/// preempted, the last narrow one is believed more than the wide one of now.
class RealtimeToRaw {
 public:
  explicit RealtimeToRaw(Kernel& kernel) noexcept;

  /// `realtime_ns`: a reading of CLOCK_REALTIME, not older than a few seconds.
  [[nodiscard]] Result<FreeRunningTime, MappingError> map(std::int64_t realtime_ns) noexcept;
  /// How many steps of CLOCK_REALTIME have been seen.
  [[nodiscard]] std::uint64_t steps() const noexcept { return steps_; }

  /// Both clocks at one instant.
  struct Reading {
    std::int64_t raw_ns = 0;
    std::int64_t realtime_ns = 0;
    std::int64_t width_ns = 0;  ///< the true raw time lies within ± width/2
  };
  /// The tightest bracketed reading of several.
  [[nodiscard]] Reading read() noexcept;

 private:
  /// What REALTIME has gained on RAW since the baseline.
  struct Gain {
    std::int64_t elapsed_ns = 0;  ///< of RAW
    std::int64_t by_ns = 0;
    std::int64_t doubt_ns = 0;  ///< of both readings
    bool is_step = false;
  };
  [[nodiscard]] Gain gain_of(const Reading& now) const noexcept;
  [[nodiscard]] Reading read_confirmed() noexcept;
  void learn(const Reading& now) noexcept;

  Kernel& kernel_;
  Reading baseline_;
  double slew_ = 0.0;  // REALTIME per RAW, minus 1
  // REALTIME: older stamps belong to before a step.
  std::int64_t trusted_since_ns_ = std::numeric_limits<std::int64_t>::min();
  std::uint64_t steps_ = 0;
};

}  // namespace ftcs::platform
