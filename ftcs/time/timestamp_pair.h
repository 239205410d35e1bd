// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/time/instant.h"

namespace ftcs {

/// Which way a message went. Forward ones tell offset plus path delay, backward ones offset minus
/// path delay: it takes both to know either.
enum class Direction : std::uint8_t {
  kForward,   ///< reference to local, as Sync: reference = t1 + correction, local = t2
  kBackward,  ///< local to reference, as Delay_Req: local = t3, reference = t4 - correction
};

/// One timestamped message as a protocol sees it: reference stamp and stamp of the free-running
/// oscillator. A protocol core emits these; it knows neither servo nor steered clock. The two
/// stamps lie a path delay apart, of which nothing is taken off; corrections that the network has
/// measured (correctionField) and latencies of the interface are.
struct EventPair {
  Direction direction = Direction::kForward;
  ReferenceTime reference;
  FreeRunningTime free_running;
};

/// One timestamped message between the two clocks, as a servo sees it: the discipline has added
/// what the steered clock showed at that instant. Frequency trackers read free_running, closed-loop
/// laws read local.
struct TimestampPair {
  Direction direction = Direction::kForward;
  ReferenceTime reference;
  LocalTime local;
  FreeRunningTime free_running;
};

/// A steered clock and its free-running oscillator, read at one instant.
struct ClockReading {
  FreeRunningTime free_running;
  LocalTime local;
};

/// What a classic (offset-driven) control law is given: one forward message and the path delay to
/// use with it. Origin and path delay stay apart, so that a change of the delay estimate does not
/// look like frequency: k(n) (paper eq. 12) is formed from `origin` alone, both ends with one
/// delay.
struct SyncSample {
  ReferenceTime origin;          ///< t1 + correction
  Duration path_delay;           ///< mean path delay d, eq. (2) corrected
  LocalTime local;               ///< tau_l(n): t2 on the steered clock
  FreeRunningTime free_running;  ///< t2 on the free-running oscillator

  /// What the reference showed when the message was stamped here: tau_rd(n) = tau_r(n) + d_rl(n),
  /// paper eq. (10).
  [[nodiscard]] constexpr ReferenceTime reference() const noexcept { return origin + path_delay; }
  /// Perceived offset, local minus reference: the true one plus the noise of this one message. The
  /// negative of the paper's T_offset.
  [[nodiscard]] constexpr Duration offset() const noexcept {
    return offset_from_reference(local, reference());
  }
};

}  // namespace ftcs
