// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ftcs/platform/clock_device.h"
#include "ftcs/platform/cross_timestamp.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// A clock of this host that shows plant time, read against CLOCK_MONOTONIC, on the epoch of
/// distributed clocks (2000-01-01; ETG.1000.4, 6.8.1): nanoseconds of TAI since 1970 less
/// 946,684,800 s.
class PlantClock {
 public:
  /// "tai": CLOCK_TAI; "realtime": CLOCK_REALTIME, where no leap second is to come; "/dev/ptpN": a
  /// PTP hardware clock. One sentence if it cannot be plant time.
  [[nodiscard]] static Result<PlantClock, std::string> open(const std::string& source,
                                                            platform::Kernel& kernel);

  /// Plant time when CLOCK_MONOTONIC showed `instant`, which lies a few milliseconds back at most.
  /// A system clock answers always and without a system call. A hardware clock is asked over its
  /// bus: once in eighth of a second, in between there is no value.
  [[nodiscard]] std::optional<ReferenceTime> at(FreeRunningTime instant);
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  PlantClock(platform::Kernel& kernel, std::string name, clockid_t id)
      : kernel_(&kernel), name_(std::move(name)), id_(id) {}
  [[nodiscard]] std::optional<ReferenceTime> from_system(FreeRunningTime instant) const;
  [[nodiscard]] std::optional<ReferenceTime> from_hardware(FreeRunningTime instant);

  platform::Kernel* kernel_;
  std::string name_;
  clockid_t id_;
  std::unique_ptr<platform::ClockDevice> device_;
  std::unique_ptr<platform::CrossTimestamper> cross_;
  std::optional<FreeRunningTime> last_read_;
};

}  // namespace ftcs::daemon
