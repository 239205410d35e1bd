// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "ftcs/time/instant.h"

namespace ftcs::daemon {

/// What a clock of plant time showed when CLOCK_MONOTONIC showed `instant`.
struct PlantReading {
  FreeRunningTime instant;
  ReferenceTime plant;
};

/// Plant time in each cycle, from readings some eighths of a second apart: the line through the
/// newest reading with the slope from the oldest one that is kept,
///
///   plant(t) = p_n + (t - t_n) (p_n - p_1) / (t_n - t_1)
///
/// A second after the last reading nothing is known any more. A reading further than 10 us from the
/// line is a jump, and the line begins anew: between two readings no crystal wanders as far. Who is
/// asked more often, as a PTP receiver with each message that comes, is heard ten times a second.
class PlantLine {
 public:
  void add(const PlantReading& reading) noexcept;
  [[nodiscard]] std::optional<ReferenceTime> at(FreeRunningTime instant) const noexcept;

 private:
  static constexpr std::size_t kKept = 8;
  [[nodiscard]] const PlantReading& newest() const noexcept { return kept_[(count_ - 1) % kKept]; }
  [[nodiscard]] ReferenceTime extended_to(FreeRunningTime instant) const noexcept;

  std::array<PlantReading, kKept> kept_{};
  std::size_t count_ = 0;  ///< of all that belong to this line
};

}  // namespace ftcs::daemon
