// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "apps/ftcs/leap_seconds.h"
#include "apps/ftcs/log.h"
#include "ftcs/platform/kernel_clock.h"
#include "ftcs/platform/kernel_time_status.h"
#include "ftcs/platform/wake_timer.h"
#include "ftcs/servo/servo.h"

namespace ftcs::app {

/// What the reference says about its timescale.
struct ReferenceScale {
  bool tai = true;                  ///< false: whatever it is, it is taken as it stands
  std::optional<int> utc_offset{};  ///< TAI - UTC, if it vouches for it
  int leap = 0;                     ///< at the end of this UTC day: +1, -1, 0 none
};

/// Where UTC comes from when the reference does not tell, and who makes a leap.
struct UtcConfig {
  int utc_offset = 37;  ///< TAI - UTC since 2017
  std::optional<LeapSeconds> leap_seconds{};
  bool kernel_leap = true;  ///< the kernel makes it (STA_INS, STA_DEL); false: we set the clock
};

/// A clock of the kernel in an event loop: wakes it to end corrections, follows UTC and leap
/// seconds, tells the kernel and the user what happens.
class RealClock {
 public:
  RealClock(platform::Kernel& kernel, Log& log, platform::KernelClock clock, UtcConfig utc);
  /// However the program ends, the clock does not stay at the rate of a correction.
  ~RealClock() { stop(); }
  RealClock(const RealClock&) = delete;
  RealClock& operator=(const RealClock&) = delete;

  [[nodiscard]] platform::KernelClock& clock() { return clock_; }
  [[nodiscard]] const std::string& name() const { return clock_.device().name(); }
  [[nodiscard]] bool is_system() const { return clock_.device().is_system(); }

  /// To be polled for reading, together with whatever the loop waits for.
  [[nodiscard]] int wake_descriptor() const { return timer_.descriptor(); }
  /// Before each wait; it will be woken when a correction has to end, or after `at_most_ns`.
  void before_wait(std::optional<std::int64_t> at_most_ns = std::nullopt);
  /// When wake_descriptor() can be read.
  void on_wake();

  /// Around a leap second the reference may be a little early or late: what it says is weighed
  /// against both offsets, and again once the leap is over.
  void set_reference_scale(const ReferenceScale& scale);
  /// Has the timescale moved under the servo's feet since the last question, other than by a leap?
  [[nodiscard]] bool take_scale_change() { return std::exchange(scale_changed_, false); }
  /// Once per turn of the loop; returns why the run must end, if it must. `steering`: a command has
  /// been applied, so that the clock is ours to describe.
  [[nodiscard]] std::optional<std::string> attend(bool steering, bool locked,
                                                  const ServoSnapshot& servo);
  /// Before the program ends: leaves the last rate that was set while the servo was locked, or else
  /// the one from before the first command.
  void stop();

 private:
  void report_foreign();
  void warn_of_expired_list();
  void follow_scale();
  [[nodiscard]] int utc_offset_at(std::int64_t utc_s) const;
  void follow_leap(bool steering);
  void leap_is_done(int leap);
  void publish(bool locked, const ServoSnapshot& servo);
  [[nodiscard]] int armed_leap(std::int64_t utc_s) const;

  platform::Kernel& kernel_;
  Log& log_;
  platform::KernelClock clock_;
  platform::WakeTimer timer_;
  UtcConfig utc_;
  ReferenceScale scale_{};
  bool scale_known_ = false;
  bool scale_followed_ = false;
  bool scale_changed_ = false;
  int armed_leap_ = 0;
  std::int64_t armed_midnight_s_ = 0;  ///< UTC: when it is due
  std::int64_t no_leap_before_s_ = 0;  ///< UTC
  int last_leap_ = 0;                  ///< the one that no_leap_before_s_ belongs to
  std::int64_t attended_raw_s_ = -1;
  Rate good_rate_;
  bool publish_failed_ = false;
  bool expiry_said_ = false;
};

/// "CLOCK_REALTIME: not permitted", for a log line.
[[nodiscard]] std::string describe(const std::string& clock, ClockError error);

}  // namespace ftcs::app
