// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/duration.h"
#include "ftcs/time/rate.h"

namespace ftcs::test {

/// Oracle for a steered clock: the plain sum of interval times rate in 128-bit integers, units of
/// 2^-85 ns, never rounded. Holds up to 2^42 ns (73 minutes) at rates between 1/2 and 2.
class ExactClock {
 public:
  void set_rate(Rate rate) noexcept {
    rate_ = static_cast<std::int64_t>(rate.ratio() * 9007199254740992.0);
  }
  void run(Duration interval) noexcept {
    sum_ += ((static_cast<Wide>(interval.floor_ns()) << 32) + interval.fraction()) * rate_;
  }
  /// What was shown since the start, rounded down to 2^-32 ns.
  [[nodiscard]] Duration shown() const noexcept {
    return Duration::from_parts(static_cast<std::int64_t>(sum_ >> 85),
                                static_cast<std::uint32_t>(sum_ >> 53));
  }

 private:
  __extension__ using Wide = __int128;
  Wide sum_ = 0;
  std::int64_t rate_ = std::int64_t{1} << 53;
};

}  // namespace ftcs::test
