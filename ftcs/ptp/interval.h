// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/time/duration.h"

namespace ftcs::ptp {

/// Intervals from 1/128 s to 128 s: every profile stays inside, and a hostile message can neither
/// make us flood the network nor fall silent.
inline constexpr std::int8_t kShortestLogInterval = -7;
inline constexpr std::int8_t kLongestLogInterval = 7;

/// 2^log_interval seconds (7.7.2.1), exact; none outside of the limits above.
[[nodiscard]] constexpr std::optional<Duration> interval_from_log(
    std::int8_t log_interval) noexcept {
  if (log_interval < kShortestLogInterval || log_interval > kLongestLogInterval) {
    return std::nullopt;
  }
  constexpr std::int64_t kShortestNs = 1'000'000'000 >> 7;  // 7,812,500: without remainder
  return Duration::from_whole_ns(kShortestNs << (log_interval - kShortestLogInterval));
}

/// times * interval, of whole nanoseconds; for small counts (no overflow is looked for).
[[nodiscard]] constexpr Duration multiply(Duration interval, int times) noexcept {
  return Duration::from_whole_ns(interval.floor_ns() * times);
}

}  // namespace ftcs::ptp
