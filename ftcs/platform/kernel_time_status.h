// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/platform/kernel.h"

namespace ftcs::platform {

/// What the kernel tells other programs about CLOCK_REALTIME (man 2 adjtimex).
struct TimeStatus {
  bool synchronised = false;        ///< STA_UNSYNC cleared, which also lets the kernel keep the RTC
  int leap = 0;                     ///< STA_INS (+1) or STA_DEL (-1): a leap second at midnight UTC
  std::optional<int> tai_offset{};  ///< TAI - UTC in seconds, shown by CLOCK_TAI
  std::int64_t estimated_error_us = 0;  ///< standard deviation
  std::int64_t largest_error_us = 0;    ///< bound; grows by 500 ppm until it is told again
  friend bool operator==(const TimeStatus&, const TimeStatus&) = default;
};

/// Writes it. Returns 0 or -errno.
[[nodiscard]] int publish(Kernel& kernel, const TimeStatus& status) noexcept;

}  // namespace ftcs::platform
