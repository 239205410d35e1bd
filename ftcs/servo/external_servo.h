// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/measurement/path_delay_estimator.h"
#include "ftcs/servo/ftcs_servo_plugin.h"
#include "ftcs/servo/servo.h"

namespace ftcs {

/// What came of the messages that such a servo heard.
struct ExternalTally {
  std::uint64_t messages = 0;
  std::uint64_t commands = 0;  ///< obeyed
  std::uint64_t unsound = 0;   ///< commands that were not finite, or back in time: not obeyed
};

/// A servo that lies outside, in a shared library. Neither the table of functions nor the instance
/// is owned: both must outlive every copy of this configuration and every servo made of it, and an
/// instance belongs to one servo at a time.
struct ExternalConfig {
  const ftcs_servo_functions* functions = nullptr;
  void* instance = nullptr;
  PathDelayConfig path_delay{};
  std::optional<Nanoseconds> fixed_path_delay{};
  ExternalTally* tally = nullptr;  ///< counted there, as long-lived as the instance
};

/// Feeds ftcs_servo_plugin.h's functions: each message with the path delay and the offset that any
/// classic servo would be given. Nothing is rejected in front of it. A command that is not finite
/// or has a negative correction time is not passed on, and the message counts as implausible.
class ExternalServo {
 public:
  /// Valid: `config` has functions and an instance.
  explicit ExternalServo(const ExternalConfig& config) noexcept
      : config_(config), delay_(config.path_delay) {}

  /// kRejected and kUsed as the library says; kImplausible for a command that was not obeyed.
  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept;
  /// Calls the library's reset(), and forgets the path delay.
  void reset() noexcept;
  /// The offset as the library believes it, where it has believe(); else as perceived.
  [[nodiscard]] ServoSnapshot snapshot() const noexcept;

 private:
  [[nodiscard]] bool path_delay_known() const noexcept {
    return config_.fixed_path_delay.has_value() || delay_.known();
  }
  [[nodiscard]] Duration path_delay() const noexcept {
    return config_.fixed_path_delay ? Duration{*config_.fixed_path_delay} : delay_.path_delay();
  }
  [[nodiscard]] ftcs_servo_observation observe(const TimestampPair& pair,
                                               const ClockReading& now) noexcept;
  ServoUpdate obey(const ftcs_servo_command& command) noexcept;

  ExternalConfig config_;
  PathDelayEstimator delay_;
  ServoSnapshot snapshot_{};
};

static_assert(ClockServo<ExternalServo>);

}  // namespace ftcs
