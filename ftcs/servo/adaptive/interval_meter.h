// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/time/timestamp_pair.h"

namespace ftcs::adaptive {

/// The servo's unit of time: the interval between messages of one direction, in ns of reference
/// time. It only has to be right within a factor of two or three, because the noise models stand
/// decades apart; so it is kept until several intervals in a row contradict it.
class IntervalMeter {
 public:
  /// `configured_ns` zero: provisional until the first two messages of one direction.
  explicit IntervalMeter(double configured_ns = 0.0) noexcept
      : interval_ns_(configured_ns > 0.0 ? configured_ns : kProvisionalNs),
        known_(configured_ns > 0.0) {}

  /// Returns how many times longer the interval has become: mostly 1.
  double observe(const TimestampPair& pair) noexcept {
    Side& side = sides_[pair.direction == Direction::kForward ? 0 : 1];
    const double elapsed = (pair.reference - side.latest).ns();
    const bool measured = side.seen && elapsed >= kShortestNs;
    side = {pair.reference, true};
    if (!measured) return 1.0;
    const bool fits = elapsed > interval_ns_ / kTolerance && elapsed < interval_ns_ * kTolerance;
    contradictions_ = fits ? 0 : static_cast<std::uint8_t>(contradictions_ + 1);
    if (known_ && contradictions_ < kContradictions) return 1.0;
    const double factor = elapsed / interval_ns_;
    interval_ns_ = elapsed;
    known_ = true;
    contradictions_ = 0;
    return factor;
  }
  [[nodiscard]] double interval_ns() const noexcept { return interval_ns_; }

 private:
  struct Side {
    ReferenceTime latest{};
    bool seen = false;
  };
  static constexpr double kProvisionalNs = 1e9;
  /// No bus is faster; stamps closer than this are not two messages of a schedule.
  static constexpr double kShortestNs = 1e3;
  static constexpr double kTolerance = 3.0;
  /// A gap or a burst now and then is no change of schedule.
  static constexpr std::uint8_t kContradictions = 4;

  std::array<Side, 2> sides_{};
  double interval_ns_;
  bool known_;
  std::uint8_t contradictions_ = 0;
};

}  // namespace ftcs::adaptive
