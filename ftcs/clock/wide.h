// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <type_traits>

namespace ftcs {

/// A 128-bit integer in two's complement, in two halves, for machines whose compiler has none (a
/// Cortex-M's): what __int128 does, modulo 2^128. Shifts by 0 to 127; a division by zero gives a
/// quotient of all ones, as it must give something.
template <bool is_signed>
class SoftInteger128 {
 public:
  constexpr SoftInteger128() noexcept = default;
  // Implicit on purpose, as between built-in integers: every value is kept.
  template <std::integral T>
  constexpr SoftInteger128(T value) noexcept  // NOLINT(google-explicit-constructor)
      : SoftInteger128(value < T{} ? ~std::uint64_t{0} : 0, static_cast<std::uint64_t>(value)) {}
  template <bool other>
  requires(other !=
           is_signed) constexpr explicit SoftInteger128(SoftInteger128<other> value) noexcept
      : SoftInteger128(value.high(), value.low()) {}

  [[nodiscard]] static constexpr SoftInteger128 from_halves(std::uint64_t high,
                                                            std::uint64_t low) noexcept {
    return {high, low};
  }
  [[nodiscard]] constexpr std::uint64_t high() const noexcept { return high_; }
  [[nodiscard]] constexpr std::uint64_t low() const noexcept { return low_; }
  /// The lowest bits.
  template <std::integral T>
  [[nodiscard]] constexpr explicit operator T() const noexcept {
    return static_cast<T>(low_);
  }

  friend constexpr SoftInteger128 operator+(SoftInteger128 a, SoftInteger128 b) noexcept {
    const std::uint64_t low = a.low_ + b.low_;
    return {a.high_ + b.high_ + (low < a.low_ ? 1U : 0U), low};
  }
  friend constexpr SoftInteger128 operator-(SoftInteger128 a, SoftInteger128 b) noexcept {
    return {a.high_ - b.high_ - (a.low_ < b.low_ ? 1U : 0U), a.low_ - b.low_};
  }
  friend constexpr SoftInteger128 operator-(SoftInteger128 a) noexcept {
    return SoftInteger128{} - a;
  }
  friend constexpr SoftInteger128 operator*(SoftInteger128 a, SoftInteger128 b) noexcept {
    const SoftInteger128 low = product(a.low_, b.low_);
    return {low.high_ + a.low_ * b.high_ + a.high_ * b.low_, low.low_};
  }
  friend constexpr SoftInteger128 operator/(SoftInteger128 a, SoftInteger128 b) noexcept {
    return divide(a, b).quotient;
  }
  friend constexpr SoftInteger128 operator%(SoftInteger128 a, SoftInteger128 b) noexcept {
    return divide(a, b).remainder;
  }
  friend constexpr SoftInteger128 operator<<(SoftInteger128 a, int bits) noexcept {
    if (bits == 0) return a;
    if (bits >= 64) return {a.low_ << (bits - 64), 0};
    return {(a.high_ << bits) | (a.low_ >> (64 - bits)), a.low_ << bits};
  }
  friend constexpr SoftInteger128 operator>>(SoftInteger128 a, int bits) noexcept {
    if (bits == 0) return a;
    if (bits >= 64) return {a.sign(), static_cast<std::uint64_t>(a.upper() >> (bits - 64))};
    return {static_cast<std::uint64_t>(a.upper() >> bits),
            (a.low_ >> bits) | (a.high_ << (64 - bits))};
  }
  friend constexpr bool operator==(SoftInteger128, SoftInteger128) noexcept = default;
  friend constexpr bool operator<(SoftInteger128 a, SoftInteger128 b) noexcept {
    return a.high_ == b.high_ ? a.low_ < b.low_ : a.upper() < b.upper();
  }

 private:
  using Upper = std::conditional_t<is_signed, std::int64_t, std::uint64_t>;
  struct Division {
    SoftInteger128 quotient;
    SoftInteger128 remainder;
  };

  constexpr SoftInteger128(std::uint64_t high, std::uint64_t low) noexcept
      : high_(high), low_(low) {}

  [[nodiscard]] constexpr Upper upper() const noexcept { return static_cast<Upper>(high_); }
  // Of the signed type all ones for a negative number, else zero: what an arithmetic shift fills.
  [[nodiscard]] constexpr std::uint64_t sign() const noexcept {
    return is_signed && (high_ >> 63) != 0 ? ~std::uint64_t{0} : 0;
  }
  [[nodiscard]] constexpr SoftInteger128 magnitude() const noexcept {
    return sign() != 0 ? -*this : *this;
  }

  // Schoolbook, in digits of 32 bits.
  [[nodiscard]] static constexpr SoftInteger128 product(std::uint64_t a, std::uint64_t b) noexcept {
    constexpr std::uint64_t kDigit = 0xFFFFFFFFU;
    const std::uint64_t low = (a & kDigit) * (b & kDigit);
    const std::uint64_t cross = (a >> 32) * (b & kDigit) + (low >> 32);
    const std::uint64_t other = (a & kDigit) * (b >> 32) + (cross & kDigit);
    return {(a >> 32) * (b >> 32) + (cross >> 32) + (other >> 32), (other << 32) | (low & kDigit)};
  }

  // Towards zero, bit by bit: only the model of an addend register divides, and silicon does that.
  [[nodiscard]] static constexpr Division divide(SoftInteger128 a, SoftInteger128 b) noexcept {
    using Magnitude = SoftInteger128<false>;
    const Magnitude dividend{a.magnitude().high_, a.magnitude().low_};
    const Magnitude divisor{b.magnitude().high_, b.magnitude().low_};
    Magnitude quotient;
    Magnitude remainder;
    for (int i = 127; i >= 0; --i) {
      const bool carry = (remainder.high_ >> 63) != 0;
      remainder = (remainder << 1) + Magnitude{(dividend >> i).low_ & 1U};
      const bool fits = carry || !(remainder < divisor);
      if (fits) remainder = remainder - divisor;
      quotient = (quotient << 1) + Magnitude{fits ? 1U : 0U};
    }
    const SoftInteger128 unsigned_quotient{quotient.high_, quotient.low_};
    const SoftInteger128 unsigned_remainder{remainder.high_, remainder.low_};
    return {a.sign() != b.sign() ? -unsigned_quotient : unsigned_quotient,
            a.sign() != 0 ? -unsigned_remainder : unsigned_remainder};
  }

  template <bool>
  friend class SoftInteger128;

  std::uint64_t high_ = 0;
  std::uint64_t low_ = 0;
};

/// The compiler's own where it has one; FTCS_SOFT_INT128 takes the replacement there too (tests).
#if defined(__SIZEOF_INT128__) && !defined(FTCS_SOFT_INT128)
__extension__ using Int128 = __int128;
__extension__ using UInt128 = unsigned __int128;
#else
using Int128 = SoftInteger128<true>;
using UInt128 = SoftInteger128<false>;
#endif

}  // namespace ftcs
