// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/measurement/delay_filter.h"
#include "ftcs/measurement/two_way_exchange.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs {

/// How path delays are measured and filtered. Unless valid(), every raw delay is refused, or the
/// filter takes another length.
struct PathDelayConfig {
  DelayFilterConfig filter{};
  Nanoseconds asymmetry{};  ///< delayAsymmetry, IEEE 1588-2019, 7.4.2: positive when reference to
                            ///< local is slower
  bool rate_compensated = true;  ///< false: as linuxptp's, the turn-around is taken as measured
  /// Below it a delay is impossible. Not zero: on a short link the noise of the stamps makes half
  /// of the raw delays slightly negative, and a median of the other half would be biased.
  Nanoseconds lowest{-1'000};
  /// Above it a delay is absurd: 100 ms is 20,000 km of fibre.
  Nanoseconds highest{100'000'000};

  [[nodiscard]] constexpr bool valid() const noexcept {
    return lowest <= highest && filter.length >= 1 && filter.length <= DelayFilter::kCapacity;
  }
};

/// What became of a backward message.
enum class PathDelayVerdict : std::uint8_t {
  kUsed,       ///< the raw delay went into the filter
  kDeferred,   ///< kept until the next forward message tells the rate
  kNoPartner,  ///< no forward message near enough to form an exchange with
  kNegative,   ///< raw delay below PathDelayConfig::lowest
  kAbsurd,     ///< raw delay above PathDelayConfig::highest
};

/// The verdict on one backward message, and what it measured.
struct PathDelayUpdate {
  PathDelayVerdict verdict = PathDelayVerdict::kUsed;
  Duration raw{};  ///< mean path delay of this exchange alone; zero unless computed
};

/// Since construction; reset() keeps them. A deferred message is counted when it is completed.
struct PathDelayCounters {
  std::uint64_t used = 0;
  std::uint64_t negative = 0;
  std::uint64_t absurd = 0;
  std::uint64_t without_partner = 0;
  std::uint64_t restarts =
      0;  ///< the forward messages did not continue: a jump of the reference, or time went backward
};

/// Path delay from forward and backward messages, entirely in free-running time: neither steering
/// nor steps of the local clock disturb it. Valid from the first exchange on: the turn-around is
/// converted to reference time by the rate ratio of the last forward messages (median of their
/// pairwise slopes, Theil 1950: one delayed message in a few cannot tilt it). A backward message
/// that comes before two forward ones is completed by the second one.
///
///     d_raw = ((t4 - t1) - r (t3 - t2)) / 2        mean_path_delay(), t1 and t2 of the forward
///                                                  message nearest to t3, at most 16 s away
///     r = median of (t1_i - t1_j) / (t2_i - t2_j)  over the last eight forward messages
///     path_delay = filter(d_raw) + asymmetry       DelayFilter; IEEE 1588-2019, 11.3.2 and 7.4.2
///
/// Forward messages are to come in the order of their stamps. One that is older than its
/// predecessor, more than an hour later, or at a ratio outside 0.5 to 2 is taken for another
/// reference: restart(), and what was measured before it keeps only its delays.
///
///     estimator.on_forward(t1, t2);                      // Sync
///     const auto update = estimator.on_backward(t3, t4); // Delay_Req: kUsed, or why not
///     if (estimator.known()) use(estimator.path_delay());
///
/// A value of some hundred octets. on_forward() looks at 28 slopes, on_backward() at eight
/// messages; the filter sorts its values. No state depends on wall time: silence changes nothing.
class PathDelayEstimator {
 public:
  explicit PathDelayEstimator(const PathDelayConfig& config) noexcept
      : config_(config), filter_(config.filter) {}

  /// Sync: origin = t1 + corrections, received = t2. An exact repetition is ignored.
  void on_forward(ReferenceTime origin, FreeRunningTime received) noexcept;
  /// Delay_Req: sent = t3, received = t4 - corrections. May come late: its partner is the nearest
  /// forward message. Only kUsed has changed path_delay(). Of several that are kDeferred the last
  /// one counts; what comes of it is told by counters() alone.
  PathDelayUpdate on_backward(FreeRunningTime sent, ReferenceTime received) noexcept;

  /// An exchange of this reference has been used.
  [[nodiscard]] bool known() const noexcept { return !filter_.empty(); }
  /// Delay from the reference to here, in reference time: filtered mean path delay plus asymmetry.
  /// Zero until known.
  [[nodiscard]] Duration path_delay() const noexcept {
    return known() ? forward_delay(mean_path_delay(), config_.asymmetry) : Duration{};
  }
  /// Filtered mean path delay, as ptp4l prints it.
  [[nodiscard]] Duration mean_path_delay() const noexcept { return filter_.value(); }
  /// The last raw delay that was accepted.
  [[nodiscard]] Duration latest() const noexcept { return latest_; }
  /// Two forward messages or more since the last restart.
  [[nodiscard]] bool rate_known() const noexcept { return forward_count_ >= 2; }
  /// Rate of the reference in units of the free-running oscillator; 1 until known.
  [[nodiscard]] Rate rate_ratio() const noexcept { return rate_ratio_; }
  [[nodiscard]] const PathDelayCounters& counters() const noexcept { return counters_; }

  /// The next forward message does not continue the last ones: forgets messages and rate, keeps the
  /// delays.
  void restart() noexcept;
  /// A new reference: forgets messages and delays, keeps the counters.
  void reset() noexcept;

 private:
  struct Forward {
    ReferenceTime origin;
    FreeRunningTime received;
  };
  struct Backward {
    FreeRunningTime sent;
    ReferenceTime received;
  };
  /// Seven intervals of baseline: noise of the rate well below that of one interval, wander still
  /// negligible.
  static constexpr std::size_t kForwards = 8;

  [[nodiscard]] const Forward& newest_forward() const noexcept {
    return forwards_[(forward_next_ + kForwards - 1) % kForwards];
  }
  [[nodiscard]] const Forward& nearest_forward(FreeRunningTime sent) const noexcept;
  [[nodiscard]] Rate measure_rate() const noexcept;
  [[nodiscard]] bool continues(const Forward& next) const noexcept;
  PathDelayUpdate complete(const Backward& backward) noexcept;

  PathDelayConfig config_;
  DelayFilter filter_;
  std::array<Forward, kForwards> forwards_{};
  std::size_t forward_next_ = 0;
  std::size_t forward_count_ = 0;
  Rate rate_ratio_{};
  bool has_deferred_ = false;
  Backward deferred_{};
  Duration latest_{};
  PathDelayCounters counters_{};
};

}  // namespace ftcs
