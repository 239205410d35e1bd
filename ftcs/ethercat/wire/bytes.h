// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ftcs::ethercat {

using Bytes = std::span<std::uint8_t>;
using ConstBytes = std::span<const std::uint8_t>;

/// Everything on an EtherCAT wire is little-endian (ETG.1000.4, 4.1); byte by byte, so that
/// alignment and the order of the host do not matter. The caller has checked that
/// `at + sizeof(T) <= bytes.size()`.
template <std::unsigned_integral T>
[[nodiscard]] constexpr T load(ConstBytes bytes, std::size_t at) noexcept {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value |= std::uint64_t{bytes[at + i]} << (8 * i);
  return static_cast<T>(value);
}

/// The counterpart of load(), under the same condition.
template <std::unsigned_integral T>
constexpr void store(Bytes bytes, std::size_t at, T value) noexcept {
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    bytes[at + i] = static_cast<std::uint8_t>(std::uint64_t{value} >> (8 * i));
  }
}

/// True if [a, a + a_size) and [b, b + b_size) share a byte.
[[nodiscard]] constexpr bool overlaps(std::size_t a, std::size_t a_size, std::size_t b,
                                      std::size_t b_size) noexcept {
  return a < b + b_size && b < a + a_size;
}

/// True if [a, a + a_size) holds the whole of [b, b + b_size).
[[nodiscard]] constexpr bool covers(std::size_t a, std::size_t a_size, std::size_t b,
                                    std::size_t b_size) noexcept {
  return a <= b && b + b_size <= a + a_size;
}

}  // namespace ftcs::ethercat
