// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/time/per_direction.h"

namespace ftcs::estimation {

/// Learns what early messages mean here. One that comes far before the moment
/// believed is a clock whose rate has changed, or an outlier: a late transmit
/// stamp, a lucky packet on a loaded bridge. The next messages tell. Until
/// changes have proved to be the rule no single message changes the rate; and
/// how often each direction has outliers is its share of what came early. Late
/// ones, which are common, are only remembered until the next of their
/// direction tells.
class EarlyMessages {
 public:
  enum class Message : std::uint8_t { kFits, kEarly, kLate, kNeither };
  /// A message was judged: as believed, far before it, far after it, or
  /// between. True: one before that was far off has proved to be an outlier,
  /// and what it said for a change is void.
  [[nodiscard]] bool observe(Direction direction, Message message) noexcept {
    Side& side = sides_[direction];
    ++side.messages;
    if (side.messages >= kLongestMemory) {
      side.messages /= 2;
      side.outliers /= 2;
    }
    const bool fits = message == Message::kFits;
    if (doubted_ > 0) {
      --doubted_;
      if (!fits) outlier(direction);
    }
    const bool explained = fits && (side.pending || side.late);
    if (fits && side.pending) outlier(direction);
    side.pending = side.pending || message == Message::kEarly;
    side.late = (side.late && !fits) || message == Message::kLate;
    return explained;
  }
  /// A rate that has changed makes one direction ever earlier, the other later:
  /// whether this message says otherwise than an early one that is not
  /// explained yet.
  [[nodiscard]] bool contradicted_by(Direction direction, bool early) const noexcept {
    return early ? sides_[opposite(direction)].pending : sides_[direction].pending;
  }
  /// Whether it says the same as one that is not explained yet.
  [[nodiscard]] bool seconded_by(Direction direction, bool early) const noexcept {
    const Side& own = sides_[direction];
    const Side& other = sides_[opposite(direction)];
    return early ? own.pending || other.late : own.late || other.pending;
  }
  /// The rate was changed; `alone`: for the last message's sake alone.
  void changed(bool alone) noexcept {
    for (const Direction direction : kDirections) {
      if (sides_[direction].pending) changes_ = std::min<std::uint8_t>(changes_ + 1U, kMost);
      sides_[direction].pending = false;
    }
    if (alone) doubted_ = kFewest;
  }
  /// Whether one message alone may change the rate.
  [[nodiscard]] bool one_suffices() const noexcept {
    return changes_ >= kFewest + kFew * outliers_;
  }
  /// Probability of an early outlier.
  [[nodiscard]] double probability(Direction direction) const noexcept {
    const Side& side = sides_[direction];
    const double share = side.outliers / (static_cast<double>(side.messages) + kPrior);
    return std::clamp(share, kHardlyEver, kOften);
  }

 private:
  struct Side {
    std::uint16_t messages = 0;
    std::uint16_t outliers = 0;
    bool pending = false;  ///< an early one has not been explained
    bool late = false;     ///< nor has a late one
  };
  void outlier(Direction direction) noexcept {
    Side& side = sides_[direction];
    side.pending = false;
    doubted_ = 0;
    side.outliers = static_cast<std::uint16_t>(side.outliers + 1U);
    outliers_ = std::min<std::uint8_t>(outliers_ + 1U, kMost);
  }
  static constexpr std::uint8_t kFewest = 2;
  static constexpr std::uint8_t kMost = kOutlierMemory;
  static constexpr double kPrior = kFew * kShortMemory;

  PerDirection<Side> sides_{};
  std::uint8_t changes_ = 0;
  std::uint8_t outliers_ = 0;
  std::uint8_t doubted_ = 0;  ///< messages that may show that the last change was none
};

/// For a grid that has no room for it: nothing makes a packet early.
class NoEarlyMessages {
 public:
  [[nodiscard]] bool observe(Direction, EarlyMessages::Message) noexcept { return false; }
  [[nodiscard]] bool contradicted_by(Direction, bool) const noexcept { return false; }
  [[nodiscard]] bool seconded_by(Direction, bool) const noexcept { return true; }
  void changed(bool) noexcept {}
  [[nodiscard]] bool one_suffices() const noexcept { return true; }
  [[nodiscard]] double probability(Direction) const noexcept { return kHardlyEver; }
};

}  // namespace ftcs::estimation
