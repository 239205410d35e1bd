// SPDX-License-Identifier: MIT
#include "ftcs/daemon/ethercat/plant_clock.h"

#include <ctime>
#include <limits>

#include <fmt/format.h>

namespace ftcs::daemon {

namespace {

constexpr std::int64_t kDcEpoch_ns = 946'684'800'000'000'000;
constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// Between two questions to a hardware clock.
constexpr std::int64_t kPause_ns = 125'000'000;
/// Quickest of so many readings.
constexpr int kReadings = 5;

/// How far `clock` is ahead of CLOCK_MONOTONIC: from the tightest of a few brackets.
std::int64_t ahead_ns(platform::Kernel& kernel, clockid_t clock) {
  std::int64_t best = 0;
  std::int64_t best_width = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < 3; ++i) {
    const std::int64_t before = kernel.clock_ns(CLOCK_MONOTONIC);
    const std::int64_t shown = kernel.clock_ns(clock);
    const std::int64_t width = kernel.clock_ns(CLOCK_MONOTONIC) - before;
    if (width >= best_width) continue;
    best_width = width;
    best = shown - (before + width / 2);
  }
  return best;
}

ReferenceTime on_dc_epoch(std::int64_t since_1970_ns) {
  return ReferenceTime::from_ns(since_1970_ns - kDcEpoch_ns);
}

}  // namespace

Result<PlantClock, std::string> PlantClock::open(const std::string& source,
                                                 platform::Kernel& kernel) {
  if (source == "realtime") return PlantClock(kernel, "CLOCK_REALTIME", CLOCK_REALTIME);
  if (source == "tai") {
    const std::int64_t ahead = ahead_ns(kernel, CLOCK_TAI) - ahead_ns(kernel, CLOCK_REALTIME);
    if (ahead > kSecond_ns) return PlantClock(kernel, "CLOCK_TAI", CLOCK_TAI);
    return fmt::format(
        "CLOCK_TAI is not set: it shows UTC, as the kernel knows no offset. A PTP or NTP program "
        "that sets it is needed, or --plant-time realtime where UTC is what is wanted");
  }
  if (source.rfind("/dev/", 0) != 0) {
    return fmt::format("'{}' is neither tai, realtime nor a device such as /dev/ptp0", source);
  }
  auto device = platform::ClockDevice::open_phc(kernel, source, platform::ClockAccess::kRead);
  if (!device) return device.error().message();
  PlantClock result(kernel, source, CLOCK_REALTIME);
  result.device_ = std::make_unique<platform::ClockDevice>(std::move(*device));
  result.cross_ = std::make_unique<platform::CrossTimestamper>(kernel, *result.device_);
  const auto reading = result.cross_->read(kReadings);
  if (!reading) return reading.error().message();
  if (reading->phc_ns >= kDcEpoch_ns) return result;
  return fmt::format(
      "{} shows a time before the year 2000: an arbitrary epoch is no plant time. Is its PTP "
      "program "
      "running, with a grandmaster that knows the date?",
      source);
}

std::optional<ReferenceTime> PlantClock::from_system(FreeRunningTime instant) const {
  return on_dc_epoch(instant.since_epoch().rounded_ns() + ahead_ns(*kernel_, id_));
}

std::optional<ReferenceTime> PlantClock::from_hardware(FreeRunningTime instant) {
  if (last_read_ && instant - *last_read_ < Duration::from_whole_ns(kPause_ns)) return std::nullopt;
  last_read_ = instant;
  const auto reading = cross_->read(kReadings);
  if (!reading) return std::nullopt;
  const std::int64_t monotonic = reading->system_ns - ahead_ns(*kernel_, CLOCK_REALTIME);
  return on_dc_epoch(reading->phc_ns + instant.since_epoch().rounded_ns() - monotonic);
}

std::optional<ReferenceTime> PlantClock::at(FreeRunningTime instant) {
  return cross_ ? from_hardware(instant) : from_system(instant);
}

}  // namespace ftcs::daemon
