// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "ftcs/diagnosis/finding.h"
#include "ftcs/discipline/cycle_servo_types.h"
#include "ftcs/ethercat/maindevice/failure.h"

namespace ftcs::diagnosis {

/// A MainDevice's cycle as it is now. Counters are of the last `cycles` cycles. Times in ns.
struct CycleSeen {
  CycleState state = CycleState::kWaiting;
  ethercat::FailureKind failure = ethercat::FailureKind::kNone;
  bool has_reference = true;  ///< a drive with a distributed clock
  std::uint16_t expected_drives = 0;
  std::uint16_t drives = 0;
  std::uint16_t working_counter = 0;
  std::uint16_t expected_counter = 0;
  bool operational = true;  ///< all drives are in OP
  std::uint16_t axes_in_fault = 0;
  std::uint16_t first_in_fault = 0;  ///< of them, its position on the wire
  std::uint64_t cycles = 0;
  std::uint64_t lost = 0;  ///< frames
  std::uint64_t late = 0;  ///< cycles that began later than the gate
  double phase_ns = 0.0;
  double margin_ns = 0.0;  ///< SYNC0 minus arrival of the frame; NaN: not measured
  double gate_ns = 0.0;    ///< largest lateness and round trip
  double cycle_ns = 0.0;
};

/// What stands between the cycle and its lock; kLocked: nothing. Of a locked cycle kMarginTooSmall
/// if its frames hardly arrive before SYNC0, kDrivesNotOperational if a drive is not in OP,
/// kAxisFault if one is, and its axis does not move. Like the two below, for the cyclic path: no
/// heap.
[[nodiscard]] Cause cause_of(const CycleSeen& seen) noexcept;
/// "locked: ...", or "not locked: ...; expected ...; ...", at most text.size() characters. A cycle
/// that is locked and has a cause nevertheless is "in phase, but ...; expected ...; ...".
std::string_view write_sentence(std::span<char> text, const CycleSeen& seen);

[[nodiscard]] Finding diagnose(const CycleSeen& seen);

}  // namespace ftcs::diagnosis
