// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"

namespace ftcs::estimation {

/// Remembers for a few messages whether those of each direction came late or
/// early against what was believed. An offset or a rate that has changed makes
/// one direction late and the other early; nothing on a path makes a packet
/// early, and a host that stands still makes both late.
class Lateness {
 public:
  /// `distance`: nu^2 / S of a message of direction `side` (0 forward, 1
  /// backward).
  void observe(std::size_t side, bool late, double distance) noexcept {
    for (Side& each : sides_) {
      if (each.remembered > 0 && --each.remembered == 0) each.came = Came::kAsBelieved;
    }
    if (distance < kThreeSigma) return;
    sides_[side] = {late ? Came::kLate : Came::kEarly, kLately};
  }
  /// Whether a clock that changed can have brought it, both directions being
  /// there.
  [[nodiscard]] bool speaks_of_clock() const noexcept {
    return sides_[0].came == Came::kAsBelieved || sides_[0].came != sides_[1].came;
  }
  void clear() noexcept { sides_ = {}; }

 private:
  enum class Came : std::uint8_t { kAsBelieved, kLate, kEarly };
  struct Side {
    Came came = Came::kAsBelieved;
    std::uint8_t remembered = 0;
  };

  std::array<Side, 2> sides_{};
};

}  // namespace ftcs::estimation
