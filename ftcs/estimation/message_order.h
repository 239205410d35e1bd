// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/tick_meter.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::estimation {

/// Decides whether a message is news: both clocks must have advanced since the
/// last one of its direction. Late and repeated messages are refused, but not
/// for ever: if refused messages themselves advance, a clock has been set back,
/// and everything before is void.
class MessageOrder {
 public:
  enum class Verdict : std::uint8_t { kNews, kDuplicate, kImplausible, kNewEpoch };

  /// kDuplicate: older on both clocks, or the same; kImplausible: newer on one of them alone;
  /// kNewEpoch: the third refused one that is newer than the refused ones before it.
  [[nodiscard]] Verdict judge(const TimestampPair& message) noexcept {
    const Stamps pair{message.reference.since_epoch().floor_ns(),
                      message.free_running.since_epoch().floor_ns()};
    Side& side = sides_[index_of(message.direction)];
    if (!side.seen || newer(pair, side.latest)) {
      jumped_ = side.seen && jump(side.latest, pair);
      if (side.seen) follow_ticks(side.latest, pair);
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
  /// Whether one clock has jumped against the other before the latest news:
  /// their advances since the message before, of the same direction, differ by
  /// more than half.
  [[nodiscard]] bool jumped() const noexcept { return jumped_; }
  /// Variance that the steps of both clocks' stamps leave open, ns^2.
  [[nodiscard]] double tick_variance_ns2() const noexcept {
    return reference_tick_.variance_ns2() + free_running_tick_.variance_ns2();
  }
  /// Noise that rounding makes in a message, ns: at least that of whole
  /// nanoseconds.
  [[nodiscard]] double rounding_ns() const noexcept {
    return std::sqrt(reference_tick_.rounding_ns2() + free_running_tick_.rounding_ns2());
  }

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

  [[nodiscard]] static std::size_t index_of(Direction direction) noexcept {
    return direction == Direction::kForward ? 0 : 1;
  }
  [[nodiscard]] static bool newer(const Stamps& a, const Stamps& b) noexcept {
    return a.reference > b.reference && a.free_running > b.free_running;
  }
  [[nodiscard]] static bool same(const Stamps& a, const Stamps& b) noexcept {
    return a.reference == b.reference && a.free_running == b.free_running;
  }

  [[nodiscard]] static bool jump(const Stamps& from, const Stamps& to) noexcept {
    const double reference =
        static_cast<double>(to.reference) - static_cast<double>(from.reference);
    const double free =
        static_cast<double>(to.free_running) - static_cast<double>(from.free_running);
    return std::abs(reference - free) > 0.5 * std::max(reference, free);
  }

  void follow_ticks(const Stamps& from, const Stamps& to) noexcept {
    reference_tick_.observe(difference(from.reference, to.reference));
    free_running_tick_.observe(difference(from.free_running, to.free_running));
  }
  [[nodiscard]] static std::uint64_t difference(std::int64_t from, std::int64_t to) noexcept {
    return static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  }

  std::array<Side, 2> sides_{};
  TickMeter reference_tick_{}, free_running_tick_{};
  bool jumped_ = false;
};

}  // namespace ftcs::estimation
