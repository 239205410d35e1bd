// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/time/duration.h"
#include "ftcs/time/instant.h"

namespace ftcs::node {

/// What a reference may show, and how far it may move. A limit of zero: none.
struct EpochRules {
  bool any_epoch = false;  ///< any date, and a timescale without an epoch, was asked for
  /// UTC, seconds since 1970. No reading can be earlier: when the program was built, or its list of
  /// leap seconds made.
  std::int64_t earliest_utc_s = 0;
  /// The first reading may be so far from the system clock.
  Nanoseconds largest_first_change{std::chrono::hours{24}};
  /// Between two readings the reference may advance by so much more or less than the machine's own
  /// oscillator.
  Nanoseconds largest_change{std::chrono::seconds{1}};
  /// And so much altogether since the first one.
  Nanoseconds largest_total_change{std::chrono::seconds{10}};
};

/// Whether a reading can be true, and if not, against what it speaks.
enum class EpochVerdict : std::uint8_t {
  kPlausible,
  kTooEarly,       ///< before EpochRules::earliest_utc_s
  kFarFromSystem,  ///< the first one, by more than largest_first_change
  kJumped,         ///< against the machine's oscillator, by more than largest_change
  kWandered,       ///< since the start, by more than largest_total_change
};

/// What else tells the time, at the instant of a reading.
struct Witnesses {
  std::int64_t system_utc_ns = 0;  ///< CLOCK_REALTIME
  /// Of the same event: an oscillator that nobody steers and that goes on while the machine sleeps.
  FreeRunningTime machine{};
};

/// Whether a reading of a reference can be true.
///
/// The first is held against the calendar and the system clock. Each later one against the line
/// that the machine's own oscillator draws from it, which no command to a clock can bend:
///
///     |(r_i - r_j) - (m_i - m_j)| <= limit + 500e-6 |m_i - m_j|
///
/// with j the last plausible reading (largest_change) and the first (largest_total_change); 500 ppm
/// is more than any crystal's error. A system clock that is itself before earliest_utc_s has never
/// been set, and is no witness: then the first reading may be anything up to 20 years later.
class EpochGate {
 public:
  explicit EpochGate(const EpochRules& rules) noexcept : rules_(rules) {}

  /// `ahead_of_utc`: what the reference's timescale is ahead of UTC by; 37 s for TAI since 2017. A
  /// reading that is not plausible changes nothing: the next one is held against the same two.
  [[nodiscard]] EpochVerdict judge(ReferenceTime reference, Duration ahead_of_utc,
                                   const Witnesses& witnesses) noexcept;
  /// Of the last one that was not plausible: how far it was from the system clock (kTooEarly,
  /// kFarFromSystem) or from the line; positive: later.
  [[nodiscard]] Duration excess() const noexcept { return excess_; }
  /// One reading at least was plausible.
  [[nodiscard]] bool has_begun() const noexcept { return first_.has_value(); }

 private:
  struct Reading {
    ReferenceTime reference{};
    FreeRunningTime machine{};
  };
  [[nodiscard]] EpochVerdict judge_first(std::int64_t utc_ns, std::int64_t system_ns) noexcept;
  [[nodiscard]] bool is_off(const Reading& reading, const Reading& since,
                            Nanoseconds limit) noexcept;

  EpochRules rules_;
  std::optional<Reading> first_{};
  Reading last_{};  ///< plausible
  Duration excess_{};
};

}  // namespace ftcs::node
