// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/per_direction.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

/// Decides whether a message is news: both clocks must have advanced since the
/// last one of its direction. Late and repeated messages are refused, but not
/// for ever: if refused messages themselves advance, a clock has been set back,
/// and everything before is void. Asked once, in front of every servo
/// (ftcs/servo/in_order.h; decision 0030).
class MessageOrder {
 public:
  enum class Verdict : std::uint8_t { kNews, kDuplicate, kImplausible, kNewEpoch };

  /// kDuplicate: older on both clocks, or the same; kImplausible: newer on one of them alone;
  /// kNewEpoch: the third refused one that is newer than the refused ones before it.
  [[nodiscard]] Verdict judge(const TimestampPair& message) noexcept {
    const Stamps pair{message.reference.since_epoch().floor_ns(),
                      message.free_running.since_epoch().floor_ns()};
    Side& side = sides_[message.direction];
    if (!side.seen || newer(pair, side.latest)) {
      side = {pair, pair, true, 0};
      return Verdict::kNews;
    }
    if (side.refused > 0 && newer(pair, side.candidate)) {
      ++side.refused;
      side.candidate = pair;
    } else if (!same(pair, side.refused > 0 ? side.candidate : side.latest)) {
      side.refused = 1;
      side.candidate = pair;
    }
    if (side.refused >= kRefusals) {
      reset();
      side = {pair, pair, true, 0};
      return Verdict::kNewEpoch;
    }
    const bool older =
        pair.reference <= side.latest.reference && pair.free_running <= side.latest.free_running;
    return older ? Verdict::kDuplicate : Verdict::kImplausible;
  }
  void reset() noexcept { *this = MessageOrder{}; }

 private:
  /// Whole nanoseconds suffice to tell two messages apart.
  struct Stamps {
    std::int64_t reference = 0;
    std::int64_t free_running = 0;
  };
  struct Side {
    Stamps latest{};     ///< newest message taken
    Stamps candidate{};  ///< newest message refused since
    bool seen = false;
    std::uint8_t refused = 0;
  };
  /// Two messages may overtake each other on the way; three in order are a new
  /// epoch.
  static constexpr std::uint8_t kRefusals = 3;

  [[nodiscard]] static bool newer(const Stamps& a, const Stamps& b) noexcept {
    return a.reference > b.reference && a.free_running > b.free_running;
  }
  [[nodiscard]] static bool same(const Stamps& a, const Stamps& b) noexcept {
    return a.reference == b.reference && a.free_running == b.free_running;
  }

  PerDirection<Side> sides_{};
};

}  // namespace ftcs
