// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ftcs/ethercat/maindevice/bridge_terminal.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs::node {

/// Plant time from the time stamps of a bridge terminal.
///
/// A pair (i, x) says that plant time was x when the terminal's own system time was i; it is some
/// milliseconds old when a frame brings it. The reference's crystal L = system time - offset has
/// meanwhile gone on undisturbed, so that at a frame which finds the reference at R
///
///   plant = x + (1 + r) ((R - o) - (i - o_i))
///
/// with o, o_i: what was added to the offset register (0x0920) until the frame, and until i; r: the
/// deviation of plant time's rate per L. o rises in steps where the reference is, and in a line
/// where a clock follows it. No stamp of the host takes part.
class BridgeClock {
 public:
  /// `is_reference`: the terminal's is the reference clock of its segment.
  void start(bool is_reference) noexcept { is_reference_ = is_reference; }
  /// A frame found the reference clock at `dc`, with so much added to its offset.
  void on_frame(LocalTime dc, std::int64_t offset_ns) noexcept;
  /// The process data of the same frame, after on_frame(). The first pair of a start is not used:
  /// it may be as old as the terminal is.
  void on_inputs(const ethercat::bridge::Inputs& inputs) noexcept;
  /// Plant time when that frame passed the reference. `tracking`: the rate of plant time per
  /// crystal, as far as it is known. None: no new stamps for kLargestAge.
  [[nodiscard]] std::optional<ReferenceTime> plant(Rate tracking) const noexcept;

  static constexpr Nanoseconds kLargestAge{1'000'000'000};

 private:
  struct Frame {
    LocalTime dc;
    std::int64_t offset_ns = 0;
  };
  [[nodiscard]] const Frame& frame(std::size_t back) const noexcept {
    return frames_[(count_ - 1 - back) % kKept];
  }
  [[nodiscard]] Duration offset_at(LocalTime instant) const noexcept;

  static constexpr std::size_t kKept = 8;
  std::array<Frame, kKept> frames_{};
  std::size_t count_ = 0;
  bool is_reference_ = false;
  bool known_ = false;
  std::optional<bool> toggle_;
  LocalTime crystal_;  ///< L of the last pair
  ReferenceTime plant_;
};

}  // namespace ftcs::node
