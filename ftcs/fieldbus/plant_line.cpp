// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/plant_line.h"

#include "ftcs/time/rate.h"

namespace ftcs::daemon {

namespace {
constexpr Duration kLargestGap{Nanoseconds{1'000'000'000}};
constexpr Duration kJump{Nanoseconds{10'000}};
/// Readings that are nearer to each other say nothing of a slope.
constexpr Duration kSmallestGap{Nanoseconds{100'000'000}};
}  // namespace

void PlantLine::add(const PlantReading& reading) noexcept {
  if (count_ > 0) {
    const Duration gap = reading.instant - newest().instant;
    if (gap > Duration{} && gap < kSmallestGap) return;
    const bool late = gap > kLargestGap;
    // The first line has no slope of its own yet: an oscillator 100 ppm off is 12 us further on.
    const bool jumped = count_ > 1 && abs(reading.plant - extended_to(reading.instant)) > kJump;
    if (late || jumped || gap <= Duration{}) count_ = 0;
  }
  kept_[count_ % kKept] = reading;
  ++count_;
}

ReferenceTime PlantLine::extended_to(FreeRunningTime instant) const noexcept {
  const PlantReading& first = kept_[count_ > kKept ? count_ % kKept : 0];
  const Duration beyond = instant - newest().instant;
  if (count_ < 2) return newest().plant + beyond;
  const double slope =
      (newest().plant - first.plant).ns() / (newest().instant - first.instant).ns();
  return newest().plant + scale(beyond, Rate::from_ratio(slope));
}

std::optional<ReferenceTime> PlantLine::at(FreeRunningTime instant) const noexcept {
  if (count_ == 0 || instant - newest().instant > kLargestGap) return std::nullopt;
  return extended_to(instant);
}

}  // namespace ftcs::daemon
