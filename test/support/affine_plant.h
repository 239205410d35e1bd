// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/servo_command.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::test {

/// elapsed * rate in extended precision (64-bit mantissa), rounded to 2^-32 ns. Independent of
/// ftcs::scale().
inline Duration scaled(Duration elapsed, long double rate) {
  const long double elapsed_ns = static_cast<long double>(elapsed.floor_ns()) +
                                 static_cast<long double>(elapsed.fraction()) * 0x1p-32L;
  const long double extra_ns = elapsed_ns * (rate - 1.0L);
  auto whole = static_cast<std::int64_t>(extra_ns);
  long double rest = extra_ns - static_cast<long double>(whole);
  if (rest < 0.0L) {
    rest += 1.0L;
    --whole;
  }
  const auto units = static_cast<std::uint64_t>(rest * 0x1p32L + 0.5L);
  return elapsed + Duration::from_parts(whole + static_cast<std::int64_t>(units >> 32),
                                        static_cast<std::uint32_t>(units));
}

/// A reference clock and a steered clock on one perfect oscillator, for tests of control laws:
///
///     reference = reference(0) + reference_rate (free running)
///     local     = affine segments, as the commands ask, each correction ending after T_c of
///     reference time
///
/// Not ftcs::VirtualClock, so that the laws are judged by something else than the product's own
/// arithmetic.
class AffinePlant {
 public:
  /// `reference_rate`: reference per free running, so that the oscillator's skew is its inverse.
  AffinePlant(long double reference_rate, Duration initial_offset)
      : reference_rate_(reference_rate),
        start_local_(ReferenceTime::from_ns(kEpochNs).since_epoch() + initial_offset) {}

  AffinePlant(long double reference_rate, Nanoseconds initial_offset)
      : AffinePlant(reference_rate, Duration{initial_offset}) {}

  [[nodiscard]] FreeRunningTime free_running() const {
    return FreeRunningTime::from_ns(kBootNs) + elapsed_;
  }
  [[nodiscard]] ReferenceTime reference() const {
    return ReferenceTime::from_ns(kEpochNs) + scaled(elapsed_, reference_rate_);
  }
  [[nodiscard]] LocalTime local() const {
    const Duration since = elapsed_ - start_;
    if (since <= correction_span_) return LocalTime{start_local_ + scaled(since, correction_rate_)};
    return LocalTime{start_local_ + scaled(correction_span_, correction_rate_) +
                     scaled(since - correction_span_, tracking_rate_)};
  }
  [[nodiscard]] ClockReading read() const { return {free_running(), local()}; }
  /// True local minus reference.
  [[nodiscard]] double offset_ns() const {
    return offset_from_reference(local(), reference()).ns();
  }
  /// Both stamps of a forward message that arrives now, sent `path_delay` of reference time ago.
  [[nodiscard]] SyncSample sample(Duration path_delay = {}) const {
    return {reference() - path_delay, path_delay, local(), free_running()};
  }

  void advance(Duration free_running) { elapsed_ += free_running; }
  void advance_reference(Duration reference) {
    elapsed_ += scaled(reference, 1.0L / reference_rate_);
  }
  void apply(const ServoCommand& command) {
    start_local_ = local().since_epoch() + command.step;
    start_ = elapsed_;
    correction_rate_ = static_cast<long double>(command.correction_rate.ratio());
    tracking_rate_ = static_cast<long double>(command.tracking_rate.ratio());
    correction_span_ = scaled(command.correction_time, 1.0L / tracking_rate_);
  }

 private:
  static constexpr std::int64_t kEpochNs = 1'700'000'000'123'456'789;
  static constexpr std::int64_t kBootNs = 5'000'000'000'000;

  long double reference_rate_;
  Duration elapsed_{};
  Duration start_{};
  Duration start_local_{};
  Duration correction_span_{};
  long double correction_rate_ = 1.0L;
  long double tracking_rate_ = 1.0L;
};

}  // namespace ftcs::test
