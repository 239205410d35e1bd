// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/time/per_direction.h"

namespace ftcs::estimation {

/// Early messages that repeat in one direction. On a bridge where nearly
/// everything waits for exactly one frame, what waits looks like all there is,
/// and the few lucky messages like outliers. But outliers are of any size;
/// lucky ones are early by the same each time, and that is where the floor is.
/// Where both directions have lucky ones, all wait alike, and the offset is
/// right as it is.
class LuckyLevel {
 public:
  /// A message of this direction, early by so many ns (negative: late) where
  /// `noise` ns > 0 is usual; `fits`: it is as believed.
  void observe(Direction direction, bool fits, double early, double noise) noexcept {
    Side& side = sides_[direction];
    if (side.without < kLongestMemory) ++side.without;
    if (side.seen > 0 && ++side.since > kOutlierMemory * side.seen) side.seen = 0;
    if (side.since >= kLongestMemory) {
      side.since /= 2;
      side.seen /= 2;
    }
    if (fits || !(early > 0.0)) return;
    side.without = 0;
    const double off = early - static_cast<double>(side.level);
    if (side.seen == 0 || off * off > kFarOff * noise * noise) {
      side.seen = 1;
      side.since = 0;
      side.level = static_cast<float>(early);
    } else {
      ++side.seen;
      side.level += static_cast<float>(off) / static_cast<float>(side.seen);
    }
  }
  /// This direction has a level (with one outlier in 300, all of one size, six come together by
  /// chance in 4 runs of 1,000, eight in none), reached by few of its messages (else the path has
  /// changed), and the other has none: so many have come without one that it is no chance.
  [[nodiscard]] bool found(Direction direction) const noexcept {
    const Side& own = sides_[direction];
    const double missing = share(direction) * sides_[opposite(direction)].without;
    return own.seen >= kLately && 2 * own.seen < own.since && missing > kConvincing;
  }
  /// Both directions have lucky messages, by the same early: the others all
  /// wait alike, and no floor of one direction is to be followed.
  [[nodiscard]] bool alike(double noise) const noexcept {
    const double apart = static_cast<double>(sides_.forward.level - sides_.backward.level);
    return std::min(sides_.forward.seen, sides_.backward.seen) >= kBoth &&
           apart * apart < kFarOff * noise * noise;
  }
  /// ns below what was believed.
  [[nodiscard]] double ns(Direction direction) const noexcept {
    return static_cast<double>(sides_[direction].level);
  }
  /// Of this direction's messages there.
  [[nodiscard]] double share(Direction direction) const noexcept {
    const Side& side = sides_[direction];
    return static_cast<double>(side.seen) / (static_cast<double>(side.since) + 1.0);
  }

 private:
  struct Side {
    float level = 0.0F;         ///< ns, mean of those seen
    std::uint16_t seen = 0;     ///< at the level
    std::uint16_t since = 0;    ///< messages since the first of them
    std::uint16_t without = 0;  ///< messages since the last early one
  };
  /// At the levels of both directions: two coincidences.
  static constexpr std::uint16_t kBoth = 2;

  PerDirection<Side> sides_{};
};

}  // namespace ftcs::estimation
