// SPDX-License-Identifier: MIT
#pragma once

#include <ctime>
#include <optional>

#include "ftcs/fieldbus/plant_clock.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/sim/drives/subdevice.h"

namespace ftcs::daemon {

/// The other side of a modelled bridge terminal: a segment whose distributed clock shows
/// CLOCK_REALTIME of this host, on the epoch of distributed clocks, in ticks of 10 ns. The time of
/// the wire is CLOCK_MONOTONIC.
class HostOtherSide final : public ethercat::OtherSide {
 public:
  explicit HostOtherSide(platform::Kernel& kernel) noexcept : kernel_(kernel) {}
  [[nodiscard]] std::optional<std::uint64_t> system_time(
      ethercat::WireTime instant) noexcept override {
    constexpr std::int64_t kTick = 10;  // ns
    const std::int64_t ahead = ahead_of_monotonic_ns(kernel_, CLOCK_REALTIME);
    const std::int64_t shown =
        on_dc_epoch(instant.since_epoch().rounded_ns() + ahead).since_epoch().rounded_ns();
    return static_cast<std::uint64_t>(shown - shown % kTick);
  }

 private:
  platform::Kernel& kernel_;
};

}  // namespace ftcs::daemon
