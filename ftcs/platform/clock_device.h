// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// May the clock be set, or is it only looked at?
enum class ClockAccess : std::uint8_t { kRead, kSteer };

/// A clock that the kernel keeps, CLOCK_REALTIME or a PTP hardware clock: what it can be asked and
/// told. Knows no history; KernelClock makes a steered clock of it.
class ClockDevice {
 public:
  /// CLOCK_REALTIME. kSteer: refused without the right to set it, and while another program of ours
  /// steers it. Nothing is touched.
  [[nodiscard]] static Result<ClockDevice, OsError> open_system(Kernel& kernel, ClockAccess access);
  /// "/dev/ptp0". kSteer: opened for writing, exclusively among our programs, by whatever name and
  /// through whichever node they open it.
  [[nodiscard]] static Result<ClockDevice, OsError> open_phc(Kernel& kernel,
                                                             const std::string& path,
                                                             ClockAccess access);
  /// The PTP hardware clock of a network interface (ETHTOOL_GET_TS_INFO).
  [[nodiscard]] static Result<ClockDevice, OsError> open_phc_of(Kernel& kernel,
                                                                const std::string& interface,
                                                                ClockAccess access);

  /// The clock and CLOCK_MONOTONIC_RAW at one instant.
  struct Reading {
    std::int64_t clock_ns = 0;
    std::int64_t raw_ns = 0;
    std::int64_t width_ns = 0;  ///< the true raw time lies within ± width/2
  };
  /// The quickest of several: whoever is preempted in the middle of one reads again. kBusy: the
  /// driver answers none of them, for now.
  [[nodiscard]] Result<Reading, ClockError> read() noexcept;
  /// The narrowest reading so far.
  [[nodiscard]] std::int64_t quickest_ns() const noexcept { return quickest_ns_; }
  /// CLOCK_MONOTONIC_RAW alone.
  [[nodiscard]] std::int64_t read_raw() noexcept { return kernel_->clock_ns(CLOCK_MONOTONIC_RAW); }
  /// The clock alone; no value: the device is gone, or its driver busy.
  [[nodiscard]] std::optional<std::int64_t> read_clock() noexcept;
  /// The rate that the kernel holds, against its own oscillator.
  [[nodiscard]] Result<Rate, ClockError> rate() noexcept;
  /// Returns the rate that the kernel made of it: multiples of 2^-16 ppm. CLOCK_REALTIME takes
  /// ±500 ppm as frequency (ADJ_FREQUENCY); what goes beyond is taken in parts of 100 ppm by the
  /// length of the tick (ADJ_TICK).
  [[nodiscard]] Result<Rate, ClockError> set_rate(Rate rate) noexcept;
  [[nodiscard]] std::optional<ClockError> step(Duration by) noexcept;

  /// Of set_rate(): CLOCK_REALTIME ±10 %, a hardware clock what its driver allows
  /// (PTP_CLOCK_GETCAPS).
  [[nodiscard]] RateLimits rate_limits() const noexcept { return limits_; }
  /// How long the machine has been asleep so far: CLOCK_MONOTONIC and _RAW stood still meanwhile.
  [[nodiscard]] std::int64_t slept_ns() noexcept {
    return kernel_->clock_ns(CLOCK_BOOTTIME) - kernel_->clock_ns(CLOCK_MONOTONIC);
  }
  [[nodiscard]] bool is_system() const noexcept { return id_ == CLOCK_REALTIME; }
  /// "CLOCK_REALTIME", "/dev/ptp0".
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// Another name, or another node of the same device, is no other clock.
  [[nodiscard]] bool is_same_clock(const ClockDevice& other) const;
  /// For a program that has this clock follow the other: no value while another one of ours has
  /// them follow each other the other way round. To be kept.
  [[nodiscard]] std::optional<Descriptor> hold_pair_with(const ClockDevice& other);
  /// Of a hardware clock: for the ioctls of <linux/ptp_clock.h>.
  [[nodiscard]] int descriptor() const noexcept { return device_.get(); }
  [[nodiscard]] Kernel& kernel() noexcept { return *kernel_; }
  /// errno of the call that failed last.
  [[nodiscard]] int error_number() const noexcept { return error_number_; }

 private:
  ClockDevice(Kernel& kernel, std::string name, clockid_t id)
      : kernel_(&kernel), name_(std::move(name)), id_(id) {}

  [[nodiscard]] std::optional<OsError> hold();
  /// The same for whatever leads to this clock; empty: the kernel does not tell.
  [[nodiscard]] std::string identity() const;
  [[nodiscard]] std::optional<OsError> probe_rights();
  [[nodiscard]] std::optional<ClockError> failed(int result) noexcept;
  [[nodiscard]] std::optional<Reading> read_once() noexcept;
  [[nodiscard]] ClockError why_unread() noexcept;
  [[nodiscard]] int change(const timex& wanted) noexcept;

  Kernel* kernel_;
  std::string name_;
  clockid_t id_;
  Descriptor device_{};
  std::int64_t number_ = 0;  // of the device, as Kernel::device_number()
  Descriptor hold_{};
  Descriptor lock_file_{};
  RateLimits limits_{};
  std::int64_t quickest_ns_ = 0;  // of all readings; 0: there was none
  int error_number_ = 0;
};

}  // namespace ftcs::platform
