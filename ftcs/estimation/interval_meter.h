// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::estimation {

/// The servo's unit of time: the interval between messages of one direction, in
/// ns of reference time. It only has to be right within a factor of two or
/// three, because the noise models stand decades apart; so it is kept until
/// several intervals in a row contradict it.
///
/// Delay_Req leave at random, 0 to 2 intervals after one another (IEEE
/// 1588-2019, 9.5.11.2), and bursts of them are usual: they count half, and a
/// forward message in time outweighs them all.
class IntervalMeter {
 public:
  /// `configured_ns` zero: provisional until the first two forward messages.
  explicit IntervalMeter(double configured_ns = 0.0) noexcept
      : interval_ns_(configured_ns > 0.0 ? configured_ns : kProvisionalNs),
        known_(configured_ns > 0.0) {}

  /// Returns how many times longer the interval has become: mostly 1.
  double observe(const TimestampPair& pair) noexcept {
    const bool forward = pair.direction == Direction::kForward;
    Side& side = sides_[forward ? 0 : 1];
    const double elapsed = (pair.reference - side.latest).ns();
    const bool measured = side.seen && elapsed >= kShortestNs;
    if (side.seen) side.span_ns += static_cast<float>(elapsed);
    side.latest = pair.reference;
    side.seen = true;
    if (!measured) return 1.0;
    if (known_ && elapsed > interval_ns_ / kTolerance && elapsed < interval_ns_ * kTolerance) {
      if (forward) trust();
      return 1.0;
    }
    if (forward || !forward_contradicts_) candidate_ns_ = elapsed;
    forward_contradicts_ = forward_contradicts_ || forward;
    doubt_ = static_cast<std::uint8_t>(doubt_ + (forward ? 2 : 1));
    // Four forward messages: a gap or a burst now and then is no change of schedule.
    if (doubt_ < (known_ ? kLately : kEnoughAtFirst)) return 1.0;
    const double factor = candidate_ns_ / interval_ns_;
    interval_ns_ = candidate_ns_;
    known_ = true;
    trust();
    return factor;
  }
  /// Above zero; one second until known.
  [[nodiscard]] double interval_ns() const noexcept { return interval_ns_; }
  /// Whether two messages of one direction are far enough apart to tell a rate:
  /// two Delay_Req a few milliseconds apart, one of them late, are no reason to
  /// steer.
  [[nodiscard]] bool tells_rate() const noexcept {
    const double needed = interval_ns_ * kBaseline;
    return std::any_of(sides_.begin(), sides_.end(), [needed](const Side& side) {
      return static_cast<double>(side.span_ns) >= needed;
    });
  }

 private:
  void trust() noexcept {
    doubt_ = 0;
    forward_contradicts_ = false;
  }

  struct Side {
    ReferenceTime latest{};
    float span_ns = 0.0F;  ///< since the first
    bool seen = false;
  };
  static constexpr double kProvisionalNs = 1e9;
  /// No bus is faster; stamps closer than this are not two messages of a
  /// schedule.
  static constexpr double kShortestNs = 1e3;
  static constexpr double kTolerance = 3.0;
  static constexpr double kBaseline = 0.125;
  static constexpr int kEnoughAtFirst = 2;

  std::array<Side, 2> sides_{};
  double interval_ns_;
  double candidate_ns_ = 0.0;  ///< what a forward message says, if one does
  bool known_;
  bool forward_contradicts_ = false;
  std::uint8_t doubt_ = 0;  ///< contradictions in a row, forward ones counted twice
};

}  // namespace ftcs::estimation
