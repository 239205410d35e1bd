// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "ftcs/platform/clock_device.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// How a PTP hardware clock is compared with CLOCK_REALTIME, best first.
enum class CrossMethod : std::uint8_t {
  kPrecise,   ///< PTP_SYS_OFFSET_PRECISE: the hardware latches both
  kExtended,  ///< PTP_SYS_OFFSET_EXTENDED: the driver reads the system clock right around the bus
              ///< access
  kBasic,     ///< PTP_SYS_OFFSET: the kernel reads it around the driver's call
  kNone,      ///< none of them
};
/// "precise", "extended", "basic", "none".
[[nodiscard]] const char* name(CrossMethod method) noexcept;

/// Both clocks at one instant; the hardware clock was read within ± delay/2 of it.
struct CrossReading {
  std::int64_t phc_ns = 0;
  std::int64_t system_ns = 0;  ///< CLOCK_REALTIME, middle of the readings before and after
  std::int64_t delay_ns = 0;   ///< between those two; 0 by kPrecise
};

/// Compares a hardware clock with CLOCK_REALTIME by the best method that its driver has, found by
/// trying.
class CrossTimestamper {
 public:
  /// `device`: a hardware clock, which must outlive this. Tries the methods once.
  CrossTimestamper(Kernel& kernel, const ClockDevice& device) noexcept;

  /// The quickest of `readings` (1 to 25).
  [[nodiscard]] Result<CrossReading, OsError> read(int readings);
  [[nodiscard]] CrossMethod method() const noexcept { return method_; }

 private:
  struct Attempt {
    int result = 0;  // negative: -errno
    CrossReading reading{};
  };
  [[nodiscard]] Attempt precise() noexcept;
  [[nodiscard]] Attempt extended(unsigned readings) noexcept;
  [[nodiscard]] Attempt basic(unsigned readings) noexcept;
  [[nodiscard]] Attempt attempt(CrossMethod method, unsigned readings) noexcept;
  [[nodiscard]] Attempt persistently(CrossMethod method, unsigned readings) noexcept;

  Kernel& kernel_;
  int descriptor_;
  std::string name_;
  CrossMethod method_ = CrossMethod::kNone;
};

}  // namespace ftcs::platform
