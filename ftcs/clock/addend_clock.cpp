// SPDX-License-Identifier: MIT
#include "ftcs/clock/addend_clock.h"

#include <algorithm>
#include <cmath>

#include "ftcs/clock/command_check.h"
#include "ftcs/clock/wide.h"
#include "ftcs/time/duration.h"

namespace ftcs {
namespace {

// Quotient rounded towards minus infinity; divisor > 0.
[[nodiscard]] constexpr Int128 floor_divide(Int128 dividend, Int128 divisor) noexcept {
  const Int128 quotient = dividend / divisor;
  return dividend % divisor < 0 ? quotient - 1 : quotient;
}

[[nodiscard]] constexpr Duration multiply(Duration step, Int128 count) noexcept {
  const Int128 units = (static_cast<Int128>(step.floor_ns()) << 32) + step.fraction();
  const Int128 product = units * count;
  return Duration::from_parts(static_cast<std::int64_t>(product >> 32),
                              static_cast<std::uint32_t>(product));
}

[[nodiscard]] double capacity(const AddendClockConfig& config) noexcept {
  return std::ldexp(1.0, config.accumulator_bits);
}

// An addend of at least one, so that the clock runs, and one that fits the register.
[[nodiscard]] RateLimits register_limits(const AddendClockConfig& config) noexcept {
  return {Rate::from_ratio(1.0 / config.nominal_addend()),
          Rate::from_ratio((capacity(config) - 1.0) / config.nominal_addend())};
}

}  // namespace

double AddendClockConfig::nominal_addend() const noexcept {
  const double ns_per_tick =
      static_cast<double>(kNsPerSecond) / static_cast<double>(nominal_frequency_hz);
  return capacity(*this) * (ns_per_tick / increment.ns());
}

bool AddendClockConfig::valid() const noexcept {
  constexpr std::uint64_t kHighestFrequency = 1'000'000'000'000;
  constexpr Duration kLargestIncrement = Nanoseconds{1'000'000};
  // A frequency of zero, an increment of zero or below: no addend makes rate 1, and the limits
  // tell.
  return nominal_frequency_hz <= kHighestFrequency && accumulator_bits >= 8 &&
         accumulator_bits <= 40 && increment <= kLargestIncrement && limits.valid() &&
         intersect(limits, register_limits(*this)).valid();
}

AddendClock::AddendClock(FreeRunningSource& source, const AddendClockConfig& config) noexcept
    : source_(source),
      config_(config),
      limits_(intersect(config.limits, register_limits(config))),
      segments_(Segment{.first_instant = config.free_running,
                        .first_tick = 0,
                        .local = config.local,
                        .accumulator = 0,
                        .addend = addend_for(config.rate),
                        .dither_error = 0}) {}

ClockReading AddendClock::read() noexcept {
  const FreeRunningTime now = source_.now();
  return {now, local_at(now)};
}

LocalTime AddendClock::local_at(FreeRunningTime instant) const noexcept {
  return advanced(segments_.at(instant), instant).local;
}

Result<ClockReading, ClockError> AddendClock::apply(const ServoCommand& command) noexcept {
  if (const auto error = find_error(command, limits_)) return *error;
  const FreeRunningTime now = source_.now();
  if (has_correction(command)) {
    steer(now, command.correction_rate, command.step);
    steer(now + correction_length(command), command.tracking_rate, Duration{});
  } else {
    steer(now, command.tracking_rate, command.step);
  }
  return ClockReading{now, local_at(now)};
}

Rate AddendClock::rate_at(FreeRunningTime instant) const noexcept {
  const double addend =
      std::ldexp(static_cast<double>(segments_.at(instant).addend), -kAddendFractionBits);
  return Rate::from_ratio(addend / config_.nominal_addend());
}

// floor(elapsed f): whole nanoseconds count in 1 / 10^9 tick, and so does the fraction once cut
// down to that.
std::int64_t AddendClock::ticks_at(FreeRunningTime instant) const noexcept {
  const Duration elapsed = instant - config_.free_running;
  const auto frequency = static_cast<Int128>(config_.nominal_frequency_hz);
  const Int128 scaled = elapsed.floor_ns() * frequency + ((elapsed.fraction() * frequency) >> 32);
  return static_cast<std::int64_t>(floor_divide(scaled, kNsPerSecond));
}

std::uint64_t AddendClock::addend_for(Rate rate) const noexcept {
  const double wanted = limits_.clamp(rate).ratio() * config_.nominal_addend();
  const int bits = config_.dither_ticks == 0 ? 0 : kAddendFractionBits;
  const auto rounded = static_cast<std::uint64_t>(std::llround(std::ldexp(wanted, bits)));
  return rounded << (kAddendFractionBits - bits);
}

// Registers at an instant. In each dither period of D ticks one integer addend holds; error
// feedback makes the sum of the first m of them floor(m u + e).
AddendClock::Segment AddendClock::advanced(const Segment& from,
                                           FreeRunningTime instant) const noexcept {
  const std::int64_t tick = ticks_at(instant);
  const Int128 period = std::max<std::uint32_t>(config_.dither_ticks, 1);
  const Int128 ticks = static_cast<Int128>(tick) - from.first_tick;
  const Int128 periods = floor_divide(ticks, period);
  const Int128 wanted =
      periods * static_cast<Int128>(from.addend) + static_cast<Int128>(from.dither_error);
  const Int128 chosen = wanted >> kAddendFractionBits;
  const Int128 next = ((wanted + static_cast<Int128>(from.addend)) >> kAddendFractionBits) - chosen;
  const Int128 total =
      static_cast<Int128>(from.accumulator) + period * chosen + (ticks - periods * period) * next;

  Segment to = from;
  to.first_instant = instant;
  to.first_tick = tick;
  to.local = from.local + multiply(config_.increment, total >> config_.accumulator_bits);
  to.accumulator =
      static_cast<std::uint64_t>(total) & ((std::uint64_t{1} << config_.accumulator_bits) - 1);
  to.dither_error =
      static_cast<std::uint64_t>(wanted) & ((std::uint64_t{1} << kAddendFractionBits) - 1);
  return to;
}

void AddendClock::steer(FreeRunningTime instant, Rate rate, Duration step) noexcept {
  Segment next = advanced(segments_.at(instant), instant);
  next.addend = addend_for(rate);
  next.local = next.local + step;
  segments_.append(next);
}

}  // namespace ftcs
