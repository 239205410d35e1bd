// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "ftcs/time/duration.h"

namespace ftcs {

/// The paper's B (Table 1) with hysteresis: entered when |offset| < enter, left when |offset| >=
/// leave. enter == leave is the literal memoryless switch. The default holds for every offset ("B =
/// inf").
struct ConvergedBand {
  static constexpr Duration kUnbounded =
      Duration::from_whole_ns(std::numeric_limits<std::int64_t>::max());
  Duration enter = kUnbounded;
  Duration leave = kUnbounded;

  /// 0 <= enter <= leave. An enter of zero is never entered.
  [[nodiscard]] constexpr bool valid() const noexcept {
    return enter >= Duration{} && leave >= enter;
  }
};

/// Remembers on which side of a ConvergedBand the offsets are. `dwell` consecutive offsets have to
/// lie below `enter` before the latch closes (0 counts as 1); one at or above `leave` opens it.
class ConvergenceLatch {
 public:
  /// Takes the next offset and returns whether the latch is closed with it.
  bool update(double offset_ns, const ConvergedBand& band, std::uint32_t dwell) noexcept {
    const double magnitude = std::abs(offset_ns);
    if (closed_) {
      closed_ = magnitude < band.leave.ns();
      if (!closed_) inside_ = 0;
      return closed_;
    }
    inside_ = magnitude < band.enter.ns() ? inside_ + 1 : 0;
    closed_ = inside_ != 0 && inside_ >= dwell;
    return closed_;
  }
  [[nodiscard]] constexpr bool closed() const noexcept { return closed_; }

 private:
  bool closed_ = false;
  std::uint32_t inside_ = 0;
};

}  // namespace ftcs
