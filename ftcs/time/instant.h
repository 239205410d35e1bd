// SPDX-License-Identifier: MIT
#pragma once

#include <compare>

#include "ftcs/time/duration.h"

namespace ftcs {

/// A reading of one clock. The tag names the timescale: readings of different timescales cannot be
/// subtracted or compared (`local - reference` does not compile; test/compile_fail shows it).
template <class Timescale>
class Instant {
 public:
  constexpr Instant() noexcept = default;
  constexpr explicit Instant(Duration since_epoch) noexcept : since_epoch_(since_epoch) {}
  [[nodiscard]] static constexpr Instant from_ns(std::int64_t whole_ns) noexcept {
    return Instant{Duration::from_whole_ns(whole_ns)};
  }

  [[nodiscard]] constexpr Duration since_epoch() const noexcept { return since_epoch_; }

  friend constexpr auto operator<=>(const Instant&, const Instant&) noexcept = default;
  friend constexpr bool operator==(const Instant&, const Instant&) noexcept = default;
  friend constexpr Duration operator-(Instant a, Instant b) noexcept {
    return a.since_epoch_ - b.since_epoch_;
  }
  friend constexpr Instant operator+(Instant instant, Duration d) noexcept {
    return Instant{instant.since_epoch_ + d};
  }
  friend constexpr Instant operator-(Instant instant, Duration d) noexcept {
    return Instant{instant.since_epoch_ - d};
  }

 private:
  Duration since_epoch_{};
};

/// The clock to be followed.
struct ReferenceTimescale;
/// What the steered clock shows.
struct LocalTimescale;
/// What the local oscillator would show had nobody ever steered it.
struct FreeRunningTimescale;

using ReferenceTime = Instant<ReferenceTimescale>;
using LocalTime = Instant<LocalTimescale>;
using FreeRunningTime = Instant<FreeRunningTimescale>;

/// Local minus reference, as IEEE 1588's offsetFromMaster (8.2.2.3): positive means the local clock
/// is ahead. The only place where two timescales meet in a subtraction; the paper's T_offset has
/// the opposite sign.
[[nodiscard]] constexpr Duration offset_from_reference(LocalTime local,
                                                       ReferenceTime reference) noexcept {
  return local.since_epoch() - reference.since_epoch();
}

}  // namespace ftcs
