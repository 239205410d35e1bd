// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cmath>
#include <compare>
#include <cstdint>

namespace ftcs {

/// Whole nanoseconds, the unit of configuration values.
using Nanoseconds = std::chrono::nanoseconds;
inline constexpr std::int64_t kNsPerSecond = 1'000'000'000;

/// A signed length of time: whole nanoseconds and a fraction in units of 2^-32 ns.
///
/// The value is `whole + fraction / 2^32` with 0 <= fraction, so whole is rounded towards minus
/// infinity. Range ±292 years, resolution 2.3e-10 ns. Sums and differences are exact and wrap
/// modulo 2^64 ns (a counter that wraps, or a hostile timestamp, is defined behaviour). The
/// fraction is what correctionField (IEEE 1588-2019, 13.3.2.9, units of 2^-16 ns) and a
/// rate-adjusted clock need: 1 ppb over 100 us is 1e-4 ns.
///
///     const Duration d = Nanoseconds{3} + Duration::from_ns(0.25);
///     d.floor_ns() == 3;  d.ns() == 3.25;  (-d).floor_ns() == -4;
///
/// Comparison is of the values as they stand, not modulo 2^64 ns: of two readings of a counter that
/// may wrap, compare the difference with Duration{}, which is right up to 146 years.
class Duration {
 public:
  constexpr Duration() noexcept = default;
  // Implicit on purpose: every whole number of nanoseconds is a Duration, without loss.
  constexpr Duration(Nanoseconds whole) noexcept
      : whole_(whole.count()) {}  // NOLINT(google-explicit-constructor)

  /// whole_ns + fraction / 2^32 ns; every pair of values is valid.
  [[nodiscard]] static constexpr Duration from_parts(std::int64_t whole_ns,
                                                     std::uint32_t fraction) noexcept {
    Duration duration;
    duration.whole_ = whole_ns;
    duration.fraction_ = fraction;
    return duration;
  }
  [[nodiscard]] static constexpr Duration from_whole_ns(std::int64_t whole_ns) noexcept {
    return from_parts(whole_ns, 0);
  }
  /// Nearest representable value; saturates at ±2^62 ns; not-a-number becomes zero.
  [[nodiscard]] static constexpr Duration from_ns(double ns) noexcept;
  /// IEEE 1588-2019, 5.3.2 TimeInterval: units of 2^-16 ns. Without loss; such a field spans ±1.6
  /// days.
  [[nodiscard]] static constexpr Duration from_scaled_ns(std::int64_t scaled) noexcept {
    return from_parts(scaled >> 16, (static_cast<std::uint32_t>(scaled) & 0xFFFFU) << 16);
  }

  /// Whole nanoseconds, rounded towards minus infinity: -0.5 ns is -1.
  [[nodiscard]] constexpr std::int64_t floor_ns() const noexcept { return whole_; }
  /// What floor_ns() leaves, in 2^-32 ns; never negative.
  [[nodiscard]] constexpr std::uint32_t fraction() const noexcept { return fraction_; }
  /// Nearest whole nanosecond, halves upwards.
  [[nodiscard]] constexpr std::int64_t rounded_ns() const noexcept {
    return wrap_add(whole_, fraction_ >> 31);
  }
  /// In nanoseconds; exact as long as the value has at most 53 significant bits.
  [[nodiscard]] constexpr double ns() const noexcept {
    return static_cast<double>(whole_) + static_cast<double>(fraction_) * kFractionUnit;
  }
  [[nodiscard]] constexpr double seconds() const noexcept { return ns() * 1e-9; }

  friend constexpr auto operator<=>(const Duration&, const Duration&) noexcept = default;
  friend constexpr bool operator==(const Duration&, const Duration&) noexcept = default;

  friend constexpr Duration operator+(Duration a, Duration b) noexcept {
    const std::uint64_t fraction = std::uint64_t{a.fraction_} + b.fraction_;
    return from_parts(
        wrap_add(wrap_add(a.whole_, b.whole_), static_cast<std::int64_t>(fraction >> 32)),
        static_cast<std::uint32_t>(fraction));
  }
  friend constexpr Duration operator-(Duration a) noexcept {
    // -(whole + f) = ~whole + (1 - f); without a fraction the carry makes it -whole.
    const std::uint32_t fraction = 0U - a.fraction_;
    return from_parts(wrap_add(~a.whole_, fraction == 0 ? 1 : 0), fraction);
  }
  friend constexpr Duration operator-(Duration a, Duration b) noexcept {
    // The upper half of the difference of the fractions is 0 or, with a borrow, -1.
    const std::uint64_t fraction = std::uint64_t{a.fraction_} - b.fraction_;
    return from_parts(
        wrap_add(wrap_subtract(a.whole_, b.whole_), static_cast<std::int64_t>(fraction) >> 32),
        static_cast<std::uint32_t>(fraction));
  }
  constexpr Duration& operator+=(Duration other) noexcept { return *this = *this + other; }
  constexpr Duration& operator-=(Duration other) noexcept { return *this = *this - other; }

  /// Half of the value, rounded to 2^-32 ns towards minus infinity.
  [[nodiscard]] constexpr Duration half() const noexcept {
    const std::uint32_t carry = static_cast<std::uint32_t>(whole_ & 1) << 31;
    return from_parts(whole_ >> 1, carry | (fraction_ >> 1));
  }

 private:
  static constexpr double kFractionUnit = 1.0 / 4294967296.0;

  [[nodiscard]] static constexpr std::int64_t wrap_add(std::int64_t a, std::int64_t b) noexcept {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
  }

  [[nodiscard]] static constexpr std::int64_t wrap_subtract(std::int64_t a,
                                                            std::int64_t b) noexcept {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
  }

  std::int64_t whole_ = 0;
  std::uint32_t fraction_ = 0;
};

constexpr Duration Duration::from_ns(double ns) noexcept {
  constexpr double kLimit = 4611686018427387904.0;  // 2^62 ns, 146 years
  if (!(ns > -kLimit)) return ns != ns ? Duration{} : from_whole_ns(-(std::int64_t{1} << 62));
  if (!(ns < kLimit)) return from_whole_ns(std::int64_t{1} << 62);
  const auto truncated = static_cast<std::int64_t>(ns);
  // Subtracted, not branched upon: the sign of noise cannot be predicted.
  const std::int64_t whole =
      truncated - static_cast<std::int64_t>(ns < static_cast<double>(truncated));
  const double rest = ns - static_cast<double>(whole);
  const auto fraction = static_cast<std::uint64_t>(rest / kFractionUnit + 0.5);
  return from_parts(whole + static_cast<std::int64_t>(fraction >> 32),
                    static_cast<std::uint32_t>(fraction));
}

/// Magnitude. That of -2^63 ns does not exist: it stays negative, as -value of it does.
[[nodiscard]] constexpr Duration abs(Duration value) noexcept {
  return value < Duration{} ? -value : value;
}

}  // namespace ftcs
