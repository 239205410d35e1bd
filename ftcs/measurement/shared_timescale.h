// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "ftcs/measurement/order_statistic.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

/// Whether other messages from the transmitter's port show the time that its Syncs show. IEEE 1588
/// does not promise it of peer delay messages: their stamps may be those of a clock that runs
/// freely (802.1AS has it so), or be taken elsewhere. So it is measured:
///
///     D = response - Sync, both reference minus free-running, Sync interpolated to the response.
///
/// One path, so D is noise of median zero if the time is one. Judged is the median of the last
/// differences against its standard error by their median absolute deviation; no limit in ns, but
/// for the resolution of stamps.
///
/// Of two messages that are close together one may have waited in a queue in which the other did
/// not, or less: a response comes right behind a Sync that left 1 ms before it, and D is 1 ms. The
/// work in a queue falls steadily and rises at once, so the median of such D is not zero. What
/// differs by more than half of the time to the nearer Sync therefore does not count; by more than
/// the time between two Syncs nothing waits. Where frames are of one length even what counts is one
/// value (a frame less the millisecond), but then much of what does not count has the other sign.
class SharedTimescale {
 public:
  enum class Verdict : std::uint8_t {
    kOpen,     ///< fewer than kFewest differences, or none of the limits reached
    kShared,   ///< until kForeign
    kForeign,  ///< until reset()
  };
  /// Differences before the first verdict, and how many the median is of: kShared is said from the
  /// fewest on, where |median| <= 3 standard errors; kForeign only of a full window, beyond 8, and
  /// if less than a quarter of the last differences do not count and have the other sign.
  static constexpr std::size_t kFewest = 4;
  static constexpr std::size_t kWindow = 64;

  /// A Sync, whose direction is forward.
  void on_sync(const EventPair& sync) noexcept {
    previous_ = sync_;
    sync_ = sync;
    syncs_ = std::min(syncs_ + 1, 2);
    compare();
  }
  /// Another message from the same port, forward too. The first one after a Sync is compared; it
  /// may be told before that Sync, or after the next.
  void on_response(const EventPair& response) noexcept {
    if (syncs_ > 0 && !has_response_) {
      response_ = response;
      has_response_ = true;
    }
    unchecked_ = std::min(unchecked_ + 1, kUncheckedLimit);
    compare();
  }
  /// Another port: all is open again.
  void reset() noexcept { *this = SharedTimescale{}; }
  [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }
  /// When the last Sync came; before the first one the zero of time.
  [[nodiscard]] FreeRunningTime last_sync() const noexcept { return sync_.free_running; }
  /// Syncs still come, and may be compared: without them nothing says that the time is one.
  [[nodiscard]] bool checked() const noexcept { return unchecked_ < kUncheckedLimit; }
  /// Median of the last differences, ns: the time that the responses show is later by this.
  [[nodiscard]] double difference_ns() const noexcept { return median_; }

 private:
  static constexpr int kUncheckedLimit = 16;
  /// Standard error of the median of normal values over that of their mean.
  static constexpr double kMedianError = 1.2533;
  /// Many clocks advance by 8 ns; where the phase of two stands still, rounding is no noise.
  static constexpr double kLeastMadNs = 8.0;
  static constexpr double kSharedBelow = 3.0;
  /// A false alarm costs a new start: with 64 values the MAD itself may be a third too small.
  static constexpr double kForeignAbove = 8.0;
  /// Of the differences so many count at least where the time is one: of a time that is off by as
  /// much as the messages are apart, those alone count that noise makes small.
  static constexpr double kClearPart = 0.25;
  /// Of another time, where few messages wait, nearly all differences are on one side of zero,
  /// those that do not count too.
  static constexpr double kAgainstPart = 0.25;

  void compare() noexcept {
    const double span = (sync_.free_running - previous_.free_running).ns();
    const double ahead = (response_.free_running - previous_.free_running).ns();
    if (!has_response_ || syncs_ < 2 || ahead >= span) return;  // until the next Sync
    has_response_ = false;
    if (ahead < 0.0) return;
    const double by_sync = (sync_.reference - previous_.reference).ns() * (ahead / span);
    const double difference = (response_.reference - previous_.reference).ns() - by_sync;
    const double off = std::abs(difference);
    const bool clear = 2.0 * off <= std::min(ahead, span - ahead) || off > span;
    compared_ = std::min(compared_ + 1, kWindow);
    const auto count = [this](double& part, bool one_more) {
      part += ((one_more ? 1.0 : 0.0) - part) / static_cast<double>(compared_);
    };
    count(clear_part_, clear);
    count(against_part_, !clear && difference * median_ <= 0.0);
    if (!clear) return;
    unchecked_ = 0;
    differences_[next_] = difference;
    next_ = (next_ + 1) % kWindow;
    size_ = std::min(size_ + 1, kWindow);
    judge();
  }
  void judge() noexcept {
    median_ = median_of(differences_);
    if (size_ < kFewest || verdict_ == Verdict::kForeign) return;
    std::array<double, kWindow> distances{};
    for (std::size_t i = 0; i < size_; ++i) distances[i] = std::abs(differences_[i] - median_);
    const double sigma = kMadToSigma * std::max(kLeastMadNs, median_of(distances));
    const double error = kMedianError * sigma / std::sqrt(static_cast<double>(size_));
    const bool differs = size_ == kWindow && std::abs(median_) > kForeignAbove * error;
    if (differs && against_part_ < kAgainstPart) {
      verdict_ = Verdict::kForeign;
    } else if (std::abs(median_) <= kSharedBelow * error && clear_part_ >= kClearPart) {
      verdict_ = Verdict::kShared;
    }
  }
  [[nodiscard]] double median_of(std::array<double, kWindow> values) const noexcept {
    const auto size = static_cast<std::ptrdiff_t>(size_);
    const double low = order_statistic(values, size, (size - 1) / 2);
    const double high = order_statistic(values, size, size / 2);
    return low + (high - low) / 2.0;
  }

  EventPair previous_{};
  EventPair sync_{};
  EventPair response_{};
  int syncs_ = 0;
  bool has_response_ = false;
  int unchecked_ = 0;
  Verdict verdict_ = Verdict::kOpen;
  std::array<double, kWindow> differences_{};
  std::size_t next_ = 0;
  std::size_t size_ = 0;
  std::size_t compared_ = 0;
  double clear_part_ = 0.0;    ///< of the last that could be compared
  double against_part_ = 0.0;  ///< likewise: does not count, other sign than the median
  double median_ = 0.0;
};

}  // namespace ftcs
