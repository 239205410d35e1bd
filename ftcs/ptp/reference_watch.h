// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "ftcs/time/timestamp_pair.h"

namespace ftcs::ptp {

/// The reference has jumped from this difference on, plus an eighth of the time between the Syncs:
/// far above the noise of any clock that can be followed, and half of the smallest jump that
/// operators make (a leap second).
inline constexpr Nanoseconds kJumpTolerance{500'000'000};

/// Whether what Syncs tell of the time goes on from what earlier ones told. One that does not is
/// believed only when others have said the same and none has contradicted them:
///
///     jump(a, b) = (reference_b - reference_a) - (event_b - event_a)
///
/// A Sync agrees with another if |jump| <= kJumpTolerance + (time between them) / 8; with the last
/// one that was believed, the time does not count for which it has been contradicted. A new time is
/// believed with its kAgreeing-th Sync in a row or a later one, over at least kLeastSpan and the
/// usual gap between two Syncs: that gap alone is what anybody can make short by adding Syncs that
/// agree. They must also be half as many as usually come in that time: who has put the true Syncs
/// out of order sends fewer; or nobody has contradicted them for kLongestSpan. A true transmitter
/// that was set is followed a second later; who can only add messages to those of one that sends a
/// Sync a second or more never is.
class ReferenceWatch {
 public:
  static constexpr int kAgreeing = 3;
  static constexpr Nanoseconds kLeastSpan{1'000'000'000};
  static constexpr Nanoseconds kLongestSpan{8'000'000'000};

  enum class Verdict : std::uint8_t {
    kGoesOn,
    kDoubted,  ///< contradicts what was believed, and not said often enough: not to be used
    kJumped    ///< said often enough: this Sync is the first of the new time
  };
  struct Finding {
    Verdict verdict = Verdict::kGoesOn;
    Duration jump{};  ///< kJumped: from the time before; positive: ahead
  };

  constexpr Finding on_sync(const EventPair& pair) noexcept {
    if (goes_on(pair)) return go_on(pair);
    if (!candidate_) contradicted_ = pair;
    if (!candidate_ || !agree(*candidate_, pair, between(*candidate_, pair))) {
      first_ = pair;
      agreeing_ = 0;
    }
    candidate_ = pair;
    ++agreeing_;
    const Duration span = pair.free_running - first_.free_running;
    const Duration gap = usual_gap_ > Duration{} ? usual_gap_ : between(*last_, first_);
    const bool dense = 2.0 * agreeing_ * gap.ns() >= span.ns() || span >= Duration{kLongestSpan};
    if (agreeing_ < kAgreeing || span < std::max(gap, Duration{kLeastSpan}) || !dense) {
      return {Verdict::kDoubted, {}};
    }
    const Duration jump = jump_between(*last_, pair);
    reset();
    last_ = pair;
    return {Verdict::kJumped, jump};
  }
  /// Of a response: nothing is learnt from it.
  [[nodiscard]] constexpr bool goes_on(const EventPair& pair) const noexcept {
    return !last_ || agree(*last_, pair, between(*last_, candidate_ ? contradicted_ : pair));
  }
  constexpr void reset() noexcept { *this = ReferenceWatch{}; }

 private:
  [[nodiscard]] static constexpr Duration jump_between(const EventPair& from,
                                                       const EventPair& to) noexcept {
    return (to.reference - from.reference) - (to.free_running - from.free_running);
  }
  [[nodiscard]] static constexpr Duration between(const EventPair& from,
                                                  const EventPair& to) noexcept {
    return abs(to.free_running - from.free_running);
  }
  [[nodiscard]] static constexpr bool agree(const EventPair& from, const EventPair& to,
                                            Duration drift_time) noexcept {
    return abs(jump_between(from, to)) <=
           Duration{kJumpTolerance} + drift_time.half().half().half();
  }
  constexpr Finding go_on(const EventPair& pair) noexcept {
    if (last_) {
      const Duration gap = pair.free_running - last_->free_running;
      if (gap <= Duration{kLongestSpan}) {  // else it was a silence
        usual_gap_ = last_gap_ > Duration{} ? std::min(gap, last_gap_) : gap;
        last_gap_ = gap;
      }
    }
    last_ = pair;
    candidate_.reset();
    return {};
  }

  std::optional<EventPair> last_{};       ///< believed
  std::optional<EventPair> candidate_{};  ///< the newest of those that contradict it
  EventPair contradicted_{};              ///< the first of them
  EventPair first_{};                     ///< the first of those that agree with the newest
  int agreeing_ = 0;
  Duration last_gap_{};
  Duration usual_gap_{};  ///< the shorter one of the last two
};

}  // namespace ftcs::ptp
