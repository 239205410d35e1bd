// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "ftcs/daemon/phc/port_watch.h"
#include "ftcs/daemon/watch/watch.h"
#include "ftcs/discipline/steering_rules.h"
#include "ftcs/node/epoch_gate.h"
#include "ftcs/servo/any_servo.h"
#include "ftcs/time/duration.h"

namespace ftcs::daemon {

/// The adaptive servo, and for -E pi the constants of phc2sys.
[[nodiscard]] inline ServoConfig phc_servo_defaults() noexcept {
  ServoConfig servo;
  servo.kind = ServoKind::kAdaptive;
  servo.linuxptp_pi.timestamping = TimestampingKind::kHardware;
  servo.linuxptp_pi.proportional_const = 0.7;
  servo.linuxptp_pi.integral_const = 0.3;
  return servo;
}

/// Everything that `ftcs phc` can be told. Defaults are phc2sys's where it has the option.
struct PhcOptions {
  std::string source;                   ///< CLOCK_REALTIME, /dev/ptpN or an interface
  std::string sink = "CLOCK_REALTIME";  ///< likewise: what is steered
  std::optional<int> sink_ahead_s{};    ///< -O: sink - source; none: by the leap second list
  std::string leap_file{};
  bool kernel_leap = true;
  bool automatic = false;        ///< -a -r: source is the clock of the PTP port that receives time
  bool system_may_lead = false;  ///< -a -r -r: and the one that transmits follows the system clock
  bool wait_for_port = false;    ///< -w: until the PTP port is synchronised; its UTC offset holds
  PortAddress port{};
  int readings = 5;
  double rate_hz = 1.0;
  ServoConfig servo = phc_servo_defaults();
  SteeringRules steering{};
  node::EpochRules epoch{};
  bool free_running = false;
  Nanoseconds first_step_threshold{20'000};
  Nanoseconds step_threshold{0};
  std::uint32_t samples_per_summary = 0;
  int log_level = 6;
  std::optional<Duration> duration{};
  /// Called when all is open that only root may open; returns what failed.
  std::function<std::optional<std::string>()> once_open{};
  WatchOptions watch{};  ///< metrics and the live page
};

}  // namespace ftcs::daemon
