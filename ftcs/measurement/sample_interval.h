// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>

#include "ftcs/time/duration.h"

namespace ftcs {

/// How far samples lie apart where nobody says it: of the last two gaps the shorter one, since a
/// missing message makes no interval longer. Zero: there was no gap yet.
class SampleInterval {
 public:
  constexpr void add(Duration gap) noexcept {
    value_ = last_gap_ > Duration{} ? std::min(gap, last_gap_) : gap;
    last_gap_ = gap;
  }
  /// The next gap is of other samples: the interval stands until it comes.
  constexpr void forget_gap() noexcept { last_gap_ = Duration{}; }
  [[nodiscard]] constexpr Duration value() const noexcept { return value_; }

 private:
  Duration value_{};
  Duration last_gap_{};
};

/// More intervals than these without a sample are an outage; one or two lost messages are none.
inline constexpr std::uint32_t kOutageIntervals = 4;

[[nodiscard]] constexpr bool is_outage(Duration silence, Duration interval,
                                       std::uint32_t intervals = kOutageIntervals) noexcept {
  return silence.ns() > interval.ns() * intervals;
}

}  // namespace ftcs
