// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "ftcs/estimation/floor_fit.h"
#include "ftcs/estimation/floor_record.h"

namespace ftcs::estimation {

/// Looks for a floor of the delays in what has come lately, a little at each
/// message: long windows of the record lose to the oscillator's wander, short
/// ones to noise; of those whose fit is certain the one that knows the offset
/// best is taken.
///
/// Two records: every message, and one of every `stride`, where stride doubles
/// while nothing is found, so that at least one of an entry's messages waited
/// for nothing: with a share w of those, 1 - (1 - w)^stride of the entries have
/// one.
class FloorSearch {
 public:
  using Record = LongestRecord;
  using Recent = FloorRecord<64>;

  /// What the filters that follow a floor already know, and how sure a new one
  /// must be.
  struct Rival {
    bool there = false;
    /// By a search, or by lucky messages: another is looked for after an alarm
    /// alone. A floor that was only begun is looked for on.
    bool found = false;
    /// It has far more noise in one direction, which may be short waits beside long ones of the
    /// other: a finer one is looked for on.
    bool uneven = false;
    double offset = 0.0;        ///< ns, at the last message
    double offset_sigma = 0.0;  ///< ns
    double rate = 0.0;          ///< ns per cycle
    /// ns; what was always below zero, by stamps that nobody calibrated, may be anything.
    double least_delay = std::numeric_limits<double>::lowest();
    double noise = 0.0;            ///< ns, of one message
    PerDirection<double> share{};  ///< of messages at the floor, learnt
  };

  void restart() noexcept;
  /// Records a message, `elapsed` cycles after the last one.
  void hear(const Record::Message& message, double elapsed) noexcept;
  /// Something is late, or early: look soon, and at everything.
  void wake() noexcept;
  /// Filters that follow a floor are in doubt: look at once.
  void alarm() noexcept { alarm_ = true; }

  /// Work of at most one window of full length. True: found() is to be adopted.
  [[nodiscard]] bool look(const Rival& rival, double least_noise) noexcept;
  /// At the last message.
  [[nodiscard]] const FloorFit& found() const noexcept { return best_; }
  /// One message of so many makes an entry of the record that the fit is from.
  [[nodiscard]] std::size_t stride() const noexcept;
  /// The filters have started from it: calls hear(direction, cycles from now,
  /// z) for the messages at its floor, in order of time, the last 64 of each
  /// direction at most.
  template <class Hear>
  void each_member(Hear hear) const noexcept;
  /// Everything recorded is as the line that was found says.
  void adopt() noexcept;

  /// ns per cycle, of the best candidate so far; nothing else may be known. 0:
  /// none.
  [[nodiscard]] double rate() const noexcept { return rate_; }
  [[nodiscard]] bool has_rate() const noexcept { return has_rate_; }
  void rescale_time(double factor) noexcept;
  void shift_offset(double shift_ns) noexcept;

 private:
  void begin() noexcept;
  [[nodiscard]] bool next_window() noexcept;
  [[nodiscard]] bool holds_window() const noexcept;
  void fit_window(const Rival& rival, double least_noise) noexcept;
  void end(const Rival& rival) noexcept;
  [[nodiscard]] PerDirection<RecordWindow> windows(std::size_t wanted, bool recent) const noexcept;

  Record record_{};
  Recent recent_{};
  FloorFit best_{};
  std::uint32_t messages_ = 0;
  std::uint32_t not_before_ = 0;
  std::uint32_t pause_ = 8;
  double rate_ = 0.0;
  bool alarm_ = false;
  std::uint16_t wanted_ = 0;       ///< length of the window that is next; 0: no scan is under way
  std::uint16_t best_wanted_ = 0;  ///< of the best fit
  bool in_recent_ = false;         ///< the scan is at the recent record
  bool best_in_recent_ = false;
  bool has_rate_ = false;
  bool scan_has_rate_ = false;
  bool fresh_ = false;  ///< an entry was completed since the last scan
  bool clear_ = false;  ///< a window showed that hardly anything waits
};

template <class Hear>
void FloorSearch::each_member(Hear hear) const noexcept {
  const auto window = windows(best_wanted_, best_in_recent_);
  const auto skipped = [](const RecordWindow& w) {  // of each direction
    return w.size > Recent::kCapacity ? w.size - Recent::kCapacity : 0;
  };
  PerDirection<std::size_t> k{skipped(window.forward), skipped(window.backward)};
  while (k.forward < window.forward.size || k.backward < window.backward.size) {
    const auto left = [&](Direction direction) { return k[direction] < window[direction].size; };
    const auto time = [&](Direction direction) {
      return window[direction].time(window[direction][k[direction]]);
    };
    const bool forward =
        !left(Direction::kBackward) ||
        (left(Direction::kForward) && time(Direction::kForward) <= time(Direction::kBackward));
    const Direction direction = forward ? Direction::kForward : Direction::kBackward;
    const RecordWindow& w = window[direction];
    const RecordedMessage& m = w[k[direction]++];
    const double t = w.time(m);
    const double nu = sign_of(direction) * (m.z - best_.offset_at(t)) - best_.estimate.d;
    double density = 0.0;
    if (best_.noise[direction].at_floor(nu, density) > 0.5) hear(direction, t, m.z);
  }
}

}  // namespace ftcs::estimation
