// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ftcs/fieldbus/plant_line.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// Nanoseconds of TAI since 1970 on the epoch of distributed clocks (2000-01-01;
/// ETG.1000.4, 6.8.1): less 946,684,800 s.
[[nodiscard]] constexpr ReferenceTime on_dc_epoch(std::int64_t since_1970_ns) noexcept {
  constexpr std::int64_t kDcEpochNs = 946'684'800'000'000'000;
  return ReferenceTime::from_ns(since_1970_ns - kDcEpochNs);
}

/// How far a clock is ahead of CLOCK_MONOTONIC: from the tightest of a few brackets.
[[nodiscard]] std::int64_t ahead_of_monotonic_ns(platform::Kernel& kernel, clockid_t clock);

/// Somebody who tells plant time now and then.
class PlantSource {
 public:
  virtual ~PlantSource() = default;
  /// Asked in each cycle, at `now` of CLOCK_MONOTONIC; none: nothing new.
  [[nodiscard]] virtual std::optional<PlantReading> read(FreeRunningTime now) = 0;
  /// Why there is nothing; one sentence, empty: not known.
  [[nodiscard]] virtual std::string reason() { return {}; }

 protected:
  PlantSource() = default;
  PlantSource(const PlantSource&) = default;
  PlantSource& operator=(const PlantSource&) = default;
};

/// A clock of this host that shows plant time, read against CLOCK_MONOTONIC, on the epoch of
/// distributed clocks.
class PlantClock {
 public:
  /// "tai": CLOCK_TAI; "realtime": CLOCK_REALTIME, where no leap second is to come; "auxN":
  /// CLOCK_AUX N; "/dev/ptpN": a PTP hardware clock. One sentence if it cannot be plant time.
  [[nodiscard]] static Result<PlantClock, std::string> open(const std::string& source,
                                                            platform::Kernel& kernel);
  /// Another source.
  PlantClock(platform::Kernel& kernel, std::string name, std::unique_ptr<PlantSource> source)
      : kernel_(&kernel), name_(std::move(name)), source_(std::move(source)) {}

  /// Plant time when CLOCK_MONOTONIC showed `instant`, which lies a few milliseconds back at most.
  /// A system clock answers always and without a system call. Any other is asked eight times a
  /// second, and a line drawn through what it said.
  [[nodiscard]] std::optional<ReferenceTime> at(FreeRunningTime instant);
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// Why at() has no value.
  [[nodiscard]] std::string reason() const { return source_ ? source_->reason() : std::string{}; }

 private:
  PlantClock(platform::Kernel& kernel, std::string name, clockid_t id)
      : kernel_(&kernel), name_(std::move(name)), id_(id) {}

  platform::Kernel* kernel_;
  std::string name_;
  clockid_t id_ = 0;
  std::unique_ptr<PlantSource> source_;  ///< null: the system clock id_
  PlantLine line_;
};

}  // namespace ftcs::daemon
