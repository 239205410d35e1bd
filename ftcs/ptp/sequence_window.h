// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>

#include "ftcs/ptp/sequence.h"
#include "ftcs/time/instant.h"

namespace ftcs::ptp {

/// Which sequence ids of authentic messages are new: those up to `width` ahead of the last one that
/// was used. Who recorded messages of others can send them again, but not under a new number.
///
/// After kPatience, and four usual intervals, without any that was used, every id is new: more
/// messages were lost than the window is wide, or the transmitter has been started again. What is
/// let in then still has to tell the time that the oscillator has kept (ReferenceWatch).
class SequenceWindow {
 public:
  static constexpr Nanoseconds kPatience{1'000'000'000};

  [[nodiscard]] constexpr bool is_new(std::uint16_t sequence_id, int width, Duration usual_interval,
                                      FreeRunningTime now) const noexcept {
    const Duration four = usual_interval + usual_interval + usual_interval + usual_interval;
    if (!has_last_ || now - used_at_ > std::max(Duration{kPatience}, four)) return true;
    const int ahead = sequence_distance(sequence_id, last_);
    return ahead > 0 && ahead <= width;
  }
  constexpr void use(std::uint16_t sequence_id, FreeRunningTime now) noexcept {
    has_last_ = true;
    last_ = sequence_id;
    used_at_ = now;
  }
  constexpr void reset() noexcept { has_last_ = false; }

 private:
  bool has_last_ = false;
  std::uint16_t last_ = 0;
  FreeRunningTime used_at_{};
};

}  // namespace ftcs::ptp
