// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/clock/segment_ring.h"

namespace ftcs {

/// The registers of a counter clock, and what they hold at the start.
struct AddendClockConfig {
  std::uint64_t nominal_frequency_hz = 0;  ///< of the oscillator, f; 1 to 10^12
  int accumulator_bits = 32;               ///< width W of accumulator and addend, 8 to 40
  Duration increment{};  ///< added to the time at each overflow; above 0, at most 1 ms
  /// The addend may change every so many ticks, between the two integers next to the wanted value,
  /// so that the mean rate is the wanted one; 0 = never: the rate is then off by up to half a unit
  /// of the addend.
  std::uint32_t dither_ticks = 0;
  FreeRunningTime free_running;  ///< at this instant, which is tick 0,
  LocalTime local;               ///< the clock shows this
  Rate rate;                     ///< and runs at this rate
  RateLimits limits;             ///< narrowed to what the addend can express

  /// The addend of rate 1, not rounded: 2^W / (f increment). The paper's clock constant k_c = f /
  /// u(0) is f over it.
  [[nodiscard]] double nominal_addend() const noexcept;
  /// In range, and fast enough to reach rate 1: f increment > 1.
  [[nodiscard]] bool valid() const noexcept;
};

/// A counter clock with an addend register, paper Fig. 2 and eq. (4).
///
/// At every tick of the oscillator the addend is added to an accumulator of W bits; when that
/// overflows, the time moves on by `increment`. So the rate is f increment addend / 2^W, and the
/// time is a staircase. Dithering is by error feedback: what one addend lacks is carried to the
/// choice of the next, so that after m choices the sum is floor(m u). Everything is in closed form:
/// a correction ends at its tick although nobody calls.
///
/// For simulation and for choosing W, f and the increment of hardware; real registers are steered
/// by RegisterClock. Commands as VirtualClock's; a rate is rounded to the nearest addend, or with
/// dithering to 2^-20 of one. Example: 32 bits, 200 MHz, increment 8 ns: an addend of 2^32 / 1.6,
/// in steps of 0.37 ppb.
class AddendClock final : public AdjustableClock {
 public:
  /// The source must outlive the clock; config.valid() must hold and is not checked.
  AddendClock(FreeRunningSource& source, const AddendClockConfig& config) noexcept;

  [[nodiscard]] ClockReading read() noexcept override;
  [[nodiscard]] LocalTime local_at(FreeRunningTime instant) const noexcept override;
  [[nodiscard]] RateLimits rate_limits() const noexcept override { return limits_; }
  [[nodiscard]] Result<ClockReading, ClockError> apply(
      const ServoCommand& command) noexcept override;

  /// The mean rate that the addend at an instant makes: the commanded one up to the addend's
  /// resolution.
  [[nodiscard]] Rate rate_at(FreeRunningTime instant) const noexcept;
  /// The number of ticks since the start.
  [[nodiscard]] std::int64_t ticks_at(FreeRunningTime instant) const noexcept;

 private:
  /// Eight commands of two segments (correction, tracking).
  static constexpr std::size_t kSegments = 16;
  /// The wanted addend is held in units of 2^-20: with 32 bits that is a rate of 2e-16.
  static constexpr int kAddendFractionBits = 20;

  // State of the registers at the tick with which a segment begins.
  struct Segment {
    FreeRunningTime first_instant;
    std::int64_t first_tick = 0;
    LocalTime local;
    std::uint64_t accumulator = 0;
    std::uint64_t addend = 0;        // units of 2^-20
    std::uint64_t dither_error = 0;  // units of 2^-20, below 2^20
    [[nodiscard]] FreeRunningTime start() const noexcept { return first_instant; }
  };

  [[nodiscard]] std::uint64_t addend_for(Rate rate) const noexcept;
  [[nodiscard]] Segment advanced(const Segment& from, FreeRunningTime instant) const noexcept;
  void steer(FreeRunningTime instant, Rate rate, Duration step) noexcept;

  FreeRunningSource& source_;
  AddendClockConfig config_;
  RateLimits limits_;
  SegmentRing<Segment, kSegments> segments_;
};

}  // namespace ftcs
