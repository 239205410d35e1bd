// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "ftcs/discipline/time_bound.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/platform/time_page.h"

namespace ftcs::daemon {

/// One instant by two clocks: the oscillator was read between two readings of CLOCK_MONOTONIC_RAW.
struct RawReading {
  FreeRunningTime free_running{};
  std::int64_t before_ns = 0;
  std::int64_t after_ns = 0;
};

/// Brings what is known of the reference, as a function of the oscillator, to CLOCK_MONOTONIC_RAW,
/// which every program can read:
///
///     slope = (f - f0) / (r - r0), over a second at least
///     rate = slope rate_f,  bound = half width(f) + slack,  growth = growth_f + (slack + slack0) /
///     (r - r0)
///
/// slack: half of what a reading took. Until a second has passed nothing is published.
class TimePublisher {
 public:
  explicit TimePublisher(platform::TimePage page) : page_(std::move(page)) {}

  void publish(const TimeBound& bound, const RawReading& reading);

 private:
  platform::TimePage page_;
  std::optional<RawReading> anchor_{};  ///< f0
  std::optional<RawReading> next_{};    ///< takes its place: the slope is of the last while
};

}  // namespace ftcs::daemon
