// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace ftcs::ptp {

/// How far sequence id `a` lies ahead of `b` on the circle of 65,536 (7.3.7): positive if `a` is
/// newer, -32,768 for the one just opposite.
[[nodiscard]] constexpr int sequence_distance(std::uint16_t a, std::uint16_t b) noexcept {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(a - b));
}

}  // namespace ftcs::ptp
