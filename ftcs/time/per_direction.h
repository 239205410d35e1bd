// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

inline constexpr std::array<Direction, 2> kDirections = {Direction::kForward, Direction::kBackward};

[[nodiscard]] constexpr Direction opposite(Direction direction) noexcept {
  return direction == Direction::kForward ? Direction::kBackward : Direction::kForward;
}

/// +1 forward, -1 backward: with it the path delay d enters what one message shows,
/// free running - reference = x + sign d. A forward message is stamped late by d on the
/// oscillator, a backward one on the reference.
[[nodiscard]] constexpr double sign_of(Direction direction) noexcept {
  return direction == Direction::kForward ? 1.0 : -1.0;
}

/// One value for the messages of each direction.
template <class T>
struct PerDirection {
  T forward{};
  T backward{};

  [[nodiscard]] constexpr T& operator[](Direction direction) noexcept {
    return direction == Direction::kForward ? forward : backward;
  }
  [[nodiscard]] constexpr const T& operator[](Direction direction) const noexcept {
    return direction == Direction::kForward ? forward : backward;
  }
};

}  // namespace ftcs
