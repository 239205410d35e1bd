// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "ftcs/time/instant.h"

namespace ftcs::ptp {

inline constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;
/// Last whole second that 64-bit nanoseconds can hold (year 2262), of 2^48 on the wire.
inline constexpr std::uint64_t kMaximumSeconds =
    static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) / kNanosecondsPerSecond -
    1;

/// 5.3.3 Timestamp as it stands on the wire.
struct WireTimestamp {
  std::uint64_t seconds = 0;  ///< 48 bits
  std::uint32_t nanoseconds = 0;
};

/// Whole nanoseconds; the fraction is dropped. None before the epoch or beyond kMaximumSeconds.
[[nodiscard]] constexpr std::optional<WireTimestamp> to_wire(ReferenceTime time) noexcept {
  const std::int64_t ns = time.since_epoch().floor_ns();
  if (ns < 0) return std::nullopt;
  const auto whole = static_cast<std::uint64_t>(ns);
  if (whole / kNanosecondsPerSecond > kMaximumSeconds) return std::nullopt;
  return WireTimestamp{whole / kNanosecondsPerSecond,
                       static_cast<std::uint32_t>(whole % kNanosecondsPerSecond)};
}

/// None if a field is out of range.
[[nodiscard]] constexpr std::optional<ReferenceTime> from_wire(WireTimestamp wire) noexcept {
  if (wire.seconds > kMaximumSeconds || wire.nanoseconds >= kNanosecondsPerSecond) {
    return std::nullopt;
  }
  return ReferenceTime::from_ns(
      static_cast<std::int64_t>(wire.seconds * kNanosecondsPerSecond + wire.nanoseconds));
}

/// 5.3.2 TimeInterval in units of 2^-16 ns, rounded towards minus infinity. None beyond ±2^47 ns.
[[nodiscard]] constexpr std::optional<std::int64_t> to_scaled_ns(Duration value) noexcept {
  constexpr std::int64_t kLimit = std::int64_t{1} << 47;
  const std::int64_t ns = value.floor_ns();
  if (ns < -kLimit || ns >= kLimit) return std::nullopt;
  return ns * 65536 + static_cast<std::int64_t>(value.fraction() >> 16);
}

/// The part of a time that a Timestamp cannot carry: at least 0, below 1 ns.
[[nodiscard]] constexpr Duration fraction_of(ReferenceTime time) noexcept {
  return Duration::from_parts(0, time.since_epoch().fraction());
}

}  // namespace ftcs::ptp
