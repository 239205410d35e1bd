// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/daemon/log.h"
#include "ftcs/node/utc_follower.h"
#include "ftcs/record/leap_seconds.h"

namespace ftcs::daemon {

using node::ReferenceScale;

/// Where UTC comes from when the reference does not tell, and who makes a leap.
struct UtcConfig {
  int utc_offset = 37;  ///< TAI - UTC since 2017
  std::optional<LeapSeconds> leap_seconds{};
  bool kernel_leap = true;  ///< the kernel makes it (STA_INS, STA_DEL); false: we set the clock
  bool reference_is_utc = false;  ///< it is the system clock; the steered one is to show TAI
  node::EpochRules epoch{};
};

/// A node::UtcFollower with the machine's clocks, its leap second list, and lines of log.
class UtcWatch {
 public:
  /// `name` begins the lines. `shows_utc`: what is steered or fed; else it shows TAI.
  UtcWatch(platform::Kernel& kernel, Log& log, std::string name, UtcConfig config, bool shows_utc);

  /// Each announcement once. `utc_s`: now, seconds since 1970.
  void on_announced(const ReferenceScale& scale, std::int64_t utc_s);
  /// Once a second.
  void on_time(std::int64_t utc_s);
  /// Whether a reading of the reference may steer. `event`: the same instant on an oscillator that
  /// nobody steers and that stands still while the machine sleeps; `utc_ns`: on the system clock.
  [[nodiscard]] bool admits(ReferenceTime reference, FreeRunningTime event, std::int64_t utc_ns);
  /// Why nothing has been followed so far, as a sentence; no value: something has, or nothing came.
  [[nodiscard]] std::optional<std::string> refusal() const;
  /// The same, once there is no hope that it changes.
  [[nodiscard]] std::optional<std::string> gave_up() const;

  [[nodiscard]] node::UtcFollower& follower() { return follower_; }
  [[nodiscard]] const node::UtcFollower& follower() const { return follower_; }
  [[nodiscard]] const UtcConfig& config() const { return config_; }

 private:
  [[nodiscard]] Duration slept() const;
  [[nodiscard]] node::UtcMoment moment(std::int64_t utc_s) const;
  void say_notes();
  void say(const node::UtcNote& note);
  void say_offset(const node::UtcNote& note);
  [[nodiscard]] std::string reason(node::UtcRefusal refusal) const;

  platform::Kernel& kernel_;
  Log& log_;
  std::string name_;
  UtcConfig config_;
  bool uses_utc_;  ///< no: nothing is said of the offset
  node::UtcFollower follower_;
};

}  // namespace ftcs::daemon
