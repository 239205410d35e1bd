// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ftcs/platform/kernel.h"
#include "ftcs/platform/kernel_clock.h"
#include "ftcs/platform/network_interface.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/platform/raw_clock.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

enum class TimestampMode : std::uint8_t {
  kBestAvailable,  ///< hardware, else software, else user space
  kHardware,       ///< the network adapter's clock, or an error
  kSoftware,       ///< the kernel, at the driver, or an error
};

/// Who read the clock for a timestamp, best first.
enum class StampSource : std::uint8_t { kHardware, kSoftware, kUserSpace };
/// "hardware", "software", "user space".
[[nodiscard]] const char* name(StampSource source) noexcept;

/// An instant of the free-running clock and who took it.
struct Stamp {
  FreeRunningTime time;
  StampSource source = StampSource::kSoftware;
};

/// What the kernel says about one packet; 0: no such stamp.
struct KernelStamps {
  std::int64_t software_ns = 0;  ///< CLOCK_REALTIME
  std::int64_t hardware_ns = 0;  ///< the adapter's clock
};

/// The free-running clock that a port's timestamps are readings of: the adapter's own clock (read,
/// never steered) with hardware timestamps, else CLOCK_MONOTONIC_RAW. Outlives the sockets, which
/// come and go with the link.
class TimestampClock {
 public:
  /// Errors: no such interface; kHardware or kSoftware asked for and not to be had; no rights on
  /// /dev/ptpN.
  [[nodiscard]] static Result<std::unique_ptr<TimestampClock>, OsError> open(
      Kernel& kernel, const std::string& interface, TimestampMode mode);

  TimestampClock(Kernel& kernel, TimestampMode mode, std::optional<HardwareClock> hardware);

  [[nodiscard]] FreeRunningSource& source() noexcept;
  [[nodiscard]] bool is_hardware() const noexcept {
    return steered_ != nullptr ? !steered_->device().is_system() : hardware_.has_value();
  }
  /// From now on timestamps are readings of a clock that is steered: CLOCK_REALTIME (software
  /// stamps) or the adapter's (hardware). It must outlive this.
  void steer(KernelClock& clock) noexcept { steered_ = &clock; }
  [[nodiscard]] TimestampMode mode() const noexcept { return mode_; }

  /// A kernel stamp on the free-running clock. No value: the kernel gave none of the kind that we
  /// use, or CLOCK_REALTIME was set since.
  [[nodiscard]] std::optional<Stamp> convert(const KernelStamps& stamps) noexcept;
  /// CLOCK_REALTIME and the free-running clock at one instant, to set a clock by.
  struct RealtimeReading {
    FreeRunningTime free_running;
    std::int64_t realtime_ns = 0;
  };
  [[nodiscard]] RealtimeReading read_realtime() noexcept;
  /// The last resort: read the clock now.
  [[nodiscard]] Stamp user_space_stamp() noexcept {
    return {source().now(), StampSource::kUserSpace};
  }
  /// Of the clock that the stamps are readings of, by somebody else; as far as was seen.
  [[nodiscard]] std::uint64_t foreign_steps() const noexcept {
    return steered_ != nullptr ? steered_->foreign_steps() : realtime_.steps();
  }

 private:
  Kernel& kernel_;
  TimestampMode mode_;
  RawClock raw_;
  RealtimeToRaw realtime_;
  std::optional<HardwareClock> hardware_;
  KernelClock* steered_ = nullptr;
};

}  // namespace ftcs::platform
