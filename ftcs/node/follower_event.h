// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <variant>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/discipline/jump_plan.h"
#include "ftcs/discipline/telemetry.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::node {

/// One message that the servo was given, and what came of it.
struct Steered {
  Telemetry telemetry{};    ///< its path delay is that of the whole link, whoever measured it
  FreeRunningTime event{};  ///< when the message came or left
  LocalTime local{};        ///< what the steered clock showed then, before it was steered
  /// Offset by this message alone: local minus reference, the path delay taken off. Of a forward
  /// message, once telemetry.servo.offset_known.
  Duration perceived{};
  bool paces = true;  ///< one of those that come once a Sync interval; others are heard beside them
};

/// A decision that an operator may want to know, beside the samples.
enum class NoteKind : std::uint8_t {
  kStampsShared,        ///< the neighbour's peer delay stamps show the time of its Syncs: heard too
  kStampsForeign,       ///< they never did, by difference_ns: the link delay alone counts
  kStampsDeparted,      ///< they did and do no more, by difference_ns: begins anew without them
  kNeighbourIsAnother,  ///< exchanges are with somebody else than the transmitter: begins anew
  kAnotherLink,         ///< the delay of the link contradicts what was learnt: begins anew
  kHoldover,            ///< no usable Sync for a while; refused_syncs came in vain. Rate is kept
  kOffsetRefused,  ///< offset exceeds DisciplineConfig::largest_offset: not steered, times in a row
  kPathDelayRefused,  ///< path_delay exceeds ClockFollowerConfig::largest_path_delay, as above
  kSaturated,         ///< commands at a limit of the rate, times in a row; offset is what is left
  kClockRefused,      ///< error; the first of a series of commands that the clock did not take
  kReferenceJumped,   ///< by jump; plan is what becomes of it
};

/// One decision. Fields that a kind does not name are zero.
struct Note {
  NoteKind kind = NoteKind::kHoldover;
  double difference_ns = 0.0;
  std::uint32_t refused_syncs = 0;  ///< in a row
  Duration offset{};                ///< local minus reference
  Duration path_delay{};
  std::uint32_t times = 0;  ///< told with the first of a row, then each time that it has doubled
  ClockError error{};
  Duration jump{};  ///< of the reference, positive: ahead
  JumpPlan plan{};
  bool gated = false;  ///< the ReferenceGate does not admit that jump
};

using FollowerEvent = std::variant<Steered, Note>;

/// Whether trying again is vain: a clock that is gone, or that we may not touch. What passes (a
/// busy kernel, a rate out of range) is no reason to give up.
[[nodiscard]] constexpr bool is_lasting(ClockError error) noexcept {
  return error == ClockError::kGone || error == ClockError::kNotPermitted;
}

}  // namespace ftcs::node
