// SPDX-License-Identifier: MIT
#include "ftcs/daemon/ptp_clock.h"

#include <utility>

namespace ftcs::daemon {
namespace {

using platform::ClockAccess;
using platform::ClockDevice;
using platform::TimestampMode;

std::optional<std::string> contradiction(const PtpOptions& options) {
  if (options.clock.kind == ClockKind::kSystem && options.timestamps == TimestampMode::kHardware) {
    return "--clock system: hardware timestamps are of the adapter's clock; steer that "
           "(--clock phc) and let ftcs phc bring it to the system clock, or use -S";
  }
  if (options.clock.kind == ClockKind::kPhc && options.timestamps == TimestampMode::kSoftware) {
    return "--clock: software timestamps (-S) are of the system clock, not of a hardware clock";
  }
  return std::nullopt;
}

TimestampMode mode_for(const PtpOptions& options) {
  if (options.clock.kind == ClockKind::kSystem) return TimestampMode::kSoftware;
  if (options.clock.kind == ClockKind::kPhc) return TimestampMode::kHardware;
  return options.timestamps;
}

Result<ClockDevice, std::string> open_device(platform::Kernel& kernel, const PtpOptions& options,
                                             bool hardware) {
  const ClockAccess access =
      options.follower.free_running ? ClockAccess::kRead : ClockAccess::kSteer;
  auto device = hardware ? ClockDevice::open_phc_of(kernel, options.interface, access)
                         : ClockDevice::open_system(kernel, access);
  if (!device) return device.error().message();
  if (options.clock.device.empty()) return std::move(*device);
  const auto named = ClockDevice::open_phc(kernel, options.clock.device, ClockAccess::kRead);
  if (!named) return named.error().message();
  if (!named->is_same_clock(*device)) {
    return fmt::format("{}: hardware timestamps of {} are of {}", options.clock.device,
                       options.interface, device->name());
  }
  return std::move(*device);
}

}  // namespace

Result<PtpClocks, std::string> open_ptp_clocks(platform::Kernel& kernel, const PtpOptions& options,
                                               Log& log) {
  if (auto wrong = contradiction(options)) return std::move(*wrong);
  auto timestamps = platform::TimestampClock::open(kernel, options.interface, mode_for(options));
  if (!timestamps) {
    const platform::OsError& error = timestamps.error();
    const bool asked = error.kind == platform::OsErrorKind::kTimestampingUnsupported &&
                       options.clock.kind == ClockKind::kVirtual &&
                       options.timestamps == TimestampMode::kHardware;
    return error.message() + (asked ? "; -S takes software ones" : "");
  }
  PtpClocks clocks{std::move(*timestamps)};
  if (options.clock.kind == ClockKind::kVirtual) return clocks;

  UtcConfig utc;
  utc.utc_offset = options.transmitter.utc_offset;
  utc.kernel_leap = options.clock.kernel_leap;
  utc.epoch = options.follower.epoch;
  if (options.follower.free_running)
    utc.epoch = {true, 0, {}, {}, {}};  // measuring alone harms nothing
  if (!options.clock.leap_file.empty()) {
    auto list = LeapSeconds::read_file(options.clock.leap_file);
    if (!list) return list.error();
    utc.leap_seconds = std::move(*list);
  }
  auto device = open_device(kernel, options, clocks.timestamps->is_hardware());
  if (!device) return device.error();
  const std::string name = device->name();
  const RateLimits limits = steering_limits(*device, options.follower.servo.limits);
  platform::KernelClock clock(std::move(*device), limits, !options.follower.free_running);
  if (const auto error = clock.failure()) return describe(name, *error);
  log(LogLevel::kInfo, "{}: {}, limits {:+.0f} to {:+.0f} ppb", name,
      options.follower.free_running ? "read only" : "steered", clock.rate_limits().slowest.ppb(),
      clock.rate_limits().fastest.ppb());
  clocks.real = std::make_unique<RealClock>(kernel, log, std::move(clock), std::move(utc));
  clocks.timestamps->steer(clocks.real->clock());
  return clocks;
}

}  // namespace ftcs::daemon
