// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/plant_clock.h"

#include <ctime>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "ftcs/platform/clock_device.h"
#include "ftcs/platform/cross_timestamp.h"
#include "ftcs/time/duration.h"

namespace ftcs::daemon {

namespace {

/// Between two questions to a clock that costs a system call.
constexpr Duration kPause{Nanoseconds{125'000'000}};
/// Quickest of so many readings.
constexpr int kReadings = 5;
/// CLOCK_AUX of linux/time.h, which headers of before Linux 6.17 do not have.
constexpr clockid_t kFirstAuxiliary = 16;
constexpr int kAuxiliaries = 8;

/// Asked eight times a second.
class PacedSource : public PlantSource {
 public:
  [[nodiscard]] std::optional<PlantReading> read(FreeRunningTime now) final {
    if (last_ && now - *last_ < kPause) return std::nullopt;
    last_ = now;
    return read_now(now);
  }
  [[nodiscard]] virtual std::optional<PlantReading> read_now(FreeRunningTime now) = 0;

 private:
  std::optional<FreeRunningTime> last_;
};

/// A PTP hardware clock.
class HardwarePlantSource final : public PacedSource {
 public:
  HardwarePlantSource(platform::Kernel& kernel, platform::ClockDevice device)
      : kernel_(kernel), device_(std::move(device)), cross_(kernel, device_) {}
  [[nodiscard]] std::optional<PlantReading> read_now(FreeRunningTime) override {
    const auto reading = cross_.read(kReadings);
    if (!reading) {
      reason_ = reading.error().message();
      return std::nullopt;
    }
    const std::int64_t ahead = ahead_of_monotonic_ns(kernel_, CLOCK_REALTIME);
    return PlantReading{FreeRunningTime::from_ns(reading->system_ns - ahead),
                        on_dc_epoch(reading->phc_ns)};
  }
  [[nodiscard]] std::string reason() override { return reason_; }

 private:
  platform::Kernel& kernel_;
  platform::ClockDevice device_;
  platform::CrossTimestamper cross_;
  std::string reason_;
};

/// CLOCK_AUX: of the kernel's own, and nobody's but its user's.
class AuxiliaryPlantSource final : public PacedSource {
 public:
  AuxiliaryPlantSource(platform::Kernel& kernel, clockid_t id) : kernel_(kernel), id_(id) {}
  [[nodiscard]] std::optional<PlantReading> read_now(FreeRunningTime now) override {
    if (kernel_.clock_ns(id_) == 0) return std::nullopt;  // switched off meanwhile
    const std::int64_t instant = now.since_epoch().rounded_ns();
    return PlantReading{FreeRunningTime::from_ns(instant),
                        on_dc_epoch(instant + ahead_of_monotonic_ns(kernel_, id_))};
  }

 private:
  platform::Kernel& kernel_;
  clockid_t id_;
};

using Opened = Result<PlantClock, std::string>;

/// The first reading must be of this century.
Opened with_epoch_checked(platform::Kernel& kernel, const std::string& name,
                          std::unique_ptr<PacedSource> source) {
  const auto reading = source->read_now(FreeRunningTime::from_ns(kernel.clock_ns(CLOCK_MONOTONIC)));
  if (!reading) return fmt::format("{} cannot be read: {}", name, source->reason());
  if (reading->plant >= ReferenceTime{}) return PlantClock(kernel, name, std::move(source));
  return fmt::format(
      "{} shows a time before the year 2000: an arbitrary epoch is no plant time. Is its PTP "
      "program running, with a grandmaster that knows the date?",
      name);
}

Opened open_auxiliary(platform::Kernel& kernel, const std::string& source) {
  const int number = source.size() == 4 ? source[3] - '0' : -1;
  if (number < 0 || number >= kAuxiliaries) {
    return fmt::format("'{}' is none of aux0 to aux7", source);
  }
  const clockid_t id = kFirstAuxiliary + number;
  if (kernel.clock_ns(id) == 0) {
    return fmt::format(
        "CLOCK_AUX {} cannot be read: it needs Linux 6.17 with CONFIG_POSIX_AUX_CLOCKS, and has to "
        "be switched on in /sys/kernel/time/aux_clocks/{}",
        number, number);
  }
  return with_epoch_checked(kernel, fmt::format("CLOCK_AUX {}", number),
                            std::make_unique<AuxiliaryPlantSource>(kernel, id));
}

}  // namespace

std::int64_t ahead_of_monotonic_ns(platform::Kernel& kernel, clockid_t clock) {
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

Opened PlantClock::open(const std::string& source, platform::Kernel& kernel) {
  if (source == "realtime") return PlantClock(kernel, "CLOCK_REALTIME", CLOCK_REALTIME);
  if (source == "tai") {
    const std::int64_t ahead =
        ahead_of_monotonic_ns(kernel, CLOCK_TAI) - ahead_of_monotonic_ns(kernel, CLOCK_REALTIME);
    if (ahead > kNsPerSecond) return PlantClock(kernel, "CLOCK_TAI", CLOCK_TAI);
    return fmt::format(
        "CLOCK_TAI is not set: it shows UTC, as the kernel knows no offset. A PTP or NTP program "
        "that sets it is needed, or --plant-time realtime where UTC is what is wanted");
  }
  if (source.starts_with("aux")) return open_auxiliary(kernel, source);
  if (!source.starts_with("/dev/")) {
    return fmt::format(
        "'{}' is neither tai, realtime, auxN, ptp:INTERFACE, bridge nor a device such as /dev/ptp0",
        source);
  }
  auto device = platform::ClockDevice::open_phc(kernel, source, platform::ClockAccess::kRead);
  if (!device) return device.error().message();
  return with_epoch_checked(kernel, source,
                            std::make_unique<HardwarePlantSource>(kernel, std::move(*device)));
}

std::optional<ReferenceTime> PlantClock::at(FreeRunningTime instant) {
  if (!source_) {
    return on_dc_epoch(instant.since_epoch().rounded_ns() + ahead_of_monotonic_ns(*kernel_, id_));
  }
  if (const auto reading = source_->read(instant)) line_.add(*reading);
  return line_.at(instant);
}

}  // namespace ftcs::daemon
