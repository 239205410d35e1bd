// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/servo/servo.h"

namespace ftcs {

/// Counted since construction; a new reference does not clear them.
struct DisciplineCounters {
  std::uint64_t used = 0;         ///< forward messages that were not turned away
  std::uint64_t backward = 0;     ///< backward messages that were plausible
  std::uint64_t beside = 0;       ///< heard beside those that pace
  std::uint64_t rejected = 0;     ///< outliers
  std::uint64_t duplicate = 0;    ///< repeated or late
  std::uint64_t implausible = 0;  ///< time went backward, absurd delay or interval
  std::uint64_t commands = 0;     ///< taken by the clock
  std::uint64_t steps = 0;
  std::uint64_t clamps = 0;   ///< commands that run at a limit
  std::uint64_t refused = 0;  ///< offsets beyond largest_offset: not acted on
  std::uint64_t apply_errors = 0;
  std::uint64_t holdovers = 0;
  std::uint64_t new_references = 0;
};

/// What one message (or its absence) came to: small, plain, copied by the one thread that owns the
/// discipline. direction, verdict and the rates are those of the last message where a call was none
/// (on_silence()). Rates are local per free running.
struct Telemetry {
  Direction direction = Direction::kForward;
  SampleVerdict verdict = SampleVerdict::kUsed;
  ServoSnapshot servo{};   ///< servo.state is kHoldover while samples are missing
  ClockReading reading{};  ///< of the steered clock, when the message was handled
  Rate applied_rate{};   ///< of the command in force: its correction rate, and once the correction
                         ///< has expired its tracking rate
  Rate tracking_rate{};  ///< what the clock runs at once the correction has expired
  bool commanded = false;             ///< this message made a command, and the clock took it
  Duration step{};                    ///< that came with it
  bool offset_refused = false;        ///< the offset exceeds largest_offset
  bool locked = false;                ///< LockDetector
  std::optional<ClockError> error{};  ///< the clock refused the command
};

}  // namespace ftcs
