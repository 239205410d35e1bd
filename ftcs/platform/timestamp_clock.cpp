// SPDX-License-Identifier: MIT
#include "ftcs/platform/timestamp_clock.h"

#include <cerrno>
#include <fcntl.h>
#include <utility>

namespace ftcs::platform {

const char* name(StampSource source) noexcept {
  switch (source) {
    case StampSource::kHardware:
      return "hardware";
    case StampSource::kSoftware:
      return "software";
    case StampSource::kUserSpace:
      break;
  }
  return "user space";
}

TimestampClock::TimestampClock(Kernel& kernel, TimestampMode mode,
                               std::optional<HardwareClock> hardware)
    : kernel_(kernel),
      mode_(mode),
      raw_(kernel),
      realtime_(kernel),
      hardware_(std::move(hardware)) {}

FreeRunningSource& TimestampClock::source() noexcept {
  if (steered_ != nullptr) return *steered_;
  if (hardware_) return *hardware_;
  return raw_;
}

std::optional<Stamp> TimestampClock::convert(const KernelStamps& stamps) noexcept {
  if (steered_ != nullptr) {
    const std::int64_t stamp = is_hardware() ? stamps.hardware_ns : stamps.software_ns;
    if (stamp == 0) return std::nullopt;
    const auto instant = steered_->from_stamp(stamp);
    if (!instant) return std::nullopt;
    return Stamp{*instant, is_hardware() ? StampSource::kHardware : StampSource::kSoftware};
  }
  if (hardware_) {
    if (stamps.hardware_ns == 0) return std::nullopt;
    return Stamp{FreeRunningTime::from_ns(stamps.hardware_ns), StampSource::kHardware};
  }
  if (stamps.software_ns == 0) return std::nullopt;
  const auto mapped = realtime_.map(stamps.software_ns);
  if (!mapped) return std::nullopt;
  return Stamp{*mapped, StampSource::kSoftware};
}

TimestampClock::RealtimeReading TimestampClock::read_realtime() noexcept {
  if (steered_ == nullptr && !hardware_) {
    const RealtimeToRaw::Reading reading = realtime_.read();
    return {FreeRunningTime::from_ns(reading.raw_ns), reading.realtime_ns};
  }
  // The narrowest of a few brackets: an interrupt disturbs single ones.
  constexpr int kBrackets = 3;
  FreeRunningSource& clock = source();
  RealtimeReading best;
  Duration narrowest;
  for (int i = 0; i < kBrackets; ++i) {
    const FreeRunningTime before = clock.now();
    const std::int64_t realtime = kernel_.clock_ns(CLOCK_REALTIME);
    const Duration width = clock.now() - before;
    if (i > 0 && width >= narrowest) continue;
    narrowest = width;
    best = {before + width.half(), realtime};
  }
  return best;
}

Result<std::unique_ptr<TimestampClock>, OsError> TimestampClock::open(Kernel& kernel,
                                                                      const std::string& interface,
                                                                      TimestampMode mode) {
  const auto capabilities = interface_capabilities(kernel, interface);
  if (!capabilities) return capabilities.error();

  const auto without_hardware = [&] {
    return std::make_unique<TimestampClock>(kernel, mode, std::nullopt);
  };
  if (mode == TimestampMode::kSoftware) {
    if (capabilities->software_timestamps) return without_hardware();
    return os_error(EOPNOTSUPP, "software time stamping on " + interface);
  }
  if (!capabilities->hardware_timestamps) {
    if (mode == TimestampMode::kBestAvailable) return without_hardware();
    return os_error(EOPNOTSUPP, "hardware time stamping on " + interface);
  }
  const std::string path = "/dev/ptp" + std::to_string(capabilities->phc_index);
  const int device = kernel.open(path.c_str(), O_RDONLY);
  if (device >= 0) {
    HardwareClock clock(kernel, Descriptor(kernel, device));
    return std::make_unique<TimestampClock>(kernel, mode, std::move(clock));
  }
  if (mode == TimestampMode::kBestAvailable) return without_hardware();
  OsError error = os_error(-device, path);
  if (device == -ENOENT || device == -ENODEV) error.kind = OsErrorKind::kNoSuchDevice;
  return error;
}

}  // namespace ftcs::platform
