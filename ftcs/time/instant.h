// SPDX-License-Identifier: MIT
#pragma once

#include <compare>

#include "ftcs/time/duration.h"

namespace ftcs {

/// A reading of one clock. The tag names the timescale: readings of different timescales cannot be
/// subtracted or compared (`local - reference` does not compile; test/compile_fail shows it).
///
/// The epoch is the clock's own: that of PTP (1970-01-01 TAI; IEEE 1588-2019, 7.2.2) for a
/// reference that keeps it, the start of the machine for most oscillators. Nothing here depends on
/// it. Differences wrap modulo 2^64 ns as Duration's do, so that a counter that wraps is harmless;
/// `<` does not, and is for instants within 146 years of each other that have not wrapped.
template <class Timescale>
class Instant {
 public:
  constexpr Instant() noexcept = default;
  constexpr explicit Instant(Duration since_epoch) noexcept : since_epoch_(since_epoch) {}
  /// Whole nanoseconds since the epoch.
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

/// The clock to be followed: the paper's tau_r; the time transmitter of PTP, the reference clock of
/// an EtherCAT segment.
struct ReferenceTimescale;
/// What the steered clock shows: the paper's tau_l.
struct LocalTimescale;
/// What the local oscillator would show had nobody ever steered it: the paper's t. Rates are
/// measured on it, so that no history is bent by a correction.
struct FreeRunningTimescale;

using ReferenceTime = Instant<ReferenceTimescale>;
using LocalTime = Instant<LocalTimescale>;
using FreeRunningTime = Instant<FreeRunningTimescale>;

/// Local minus reference, as IEEE 1588-2019's offsetFromMaster (8.2.2.3): positive means the local
/// clock is ahead. The only place where two timescales meet in a subtraction; the paper's T_offset
/// (eq. 1) has the opposite sign (decision 0001). Both readings must be of one instant: a message's
/// delay is added to the reference before, as SyncSample::reference() does.
[[nodiscard]] constexpr Duration offset_from_reference(LocalTime local,
                                                       ReferenceTime reference) noexcept {
  return local.since_epoch() - reference.since_epoch();
}

}  // namespace ftcs
