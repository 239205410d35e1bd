// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "ftcs/daemon/log.h"
#include "ftcs/daemon/utc_watch.h"
#include "ftcs/node/reference_gate.h"
#include "ftcs/platform/kept_rate.h"
#include "ftcs/platform/kernel_clock.h"
#include "ftcs/platform/kernel_time_status.h"
#include "ftcs/platform/wake_timer.h"
#include "ftcs/servo/servo.h"

namespace ftcs::daemon {

/// A clock of the kernel in an event loop: wakes it to end corrections, follows UTC and leap
/// seconds, tells the kernel and the user what happens.
class RealClock final : public node::ReferenceGate {
 public:
  RealClock(platform::Kernel& kernel, Log& log, platform::KernelClock clock, UtcConfig utc);
  /// However the program ends, the clock does not stay at the rate of a correction.
  ~RealClock() override { stop(); }
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

  /// Each announcement of the reference once; what of it is believed: node::UtcFollower.
  void set_reference_scale(const ReferenceScale& scale);
  /// The user said what the reference is ahead of UTC by, and the clock of the reference.
  void set_fixed_scale(int reference_ahead_of_utc_s, int clock_ahead_of_reference_s);
  /// Whether a reading of the reference may steer; no message must reach the servo without.
  /// `event`: the same instant on the clock's free-running face.
  [[nodiscard]] bool admits(ReferenceTime reference, FreeRunningTime event) noexcept override;
  [[nodiscard]] bool admits_change(Duration change) const noexcept override;
  /// Has local time moved under the servo's feet since the last question, other than by a leap?
  [[nodiscard]] bool take_scale_change() { return std::exchange(scale_changed_, false); }
  /// Why nothing has been followed so far, if that is why: the run has failed.
  [[nodiscard]] std::optional<std::string> refusal() const { return utc_.refusal(); }
  /// Once per turn of the loop; returns why the run must end, if it must. `steering`: a command has
  /// been applied, so that the clock is ours to describe.
  [[nodiscard]] std::optional<std::string> attend(bool steering, bool locked,
                                                  const ServoSnapshot& servo);
  /// Before the program ends: leaves the rate of the last seconds in which the servo was locked, or
  /// else the one from before the first command.
  void stop();

 private:
  void report_foreign();
  void warn_of_expired_list();
  void follow_offset();
  void make_leap_if_due(bool steering);
  void say_leap(int leap);
  void publish(bool locked, const ServoSnapshot& servo);
  [[nodiscard]] std::int64_t utc_s() const;

  platform::Kernel& kernel_;
  Log& log_;
  platform::KernelClock clock_;
  platform::WakeTimer timer_;
  UtcWatch utc_;
  bool scale_known_ = false;  ///< announced, and believed
  bool scale_changed_ = false;
  std::int64_t attended_raw_s_ = -1;
  platform::KeptRate kept_rate_;
  bool was_locked_ = false;
  bool publish_failed_ = false;
  bool expiry_said_ = false;
};

/// The chosen limits; where none were chosen, CLOCK_REALTIME runs at most 500 ppm off, as every
/// kernel's adjtimex() has it and programs expect.
[[nodiscard]] RateLimits steering_limits(const platform::ClockDevice& device,
                                         const RateLimits& chosen);

/// "CLOCK_REALTIME: not permitted", for a log line.
[[nodiscard]] std::string describe(const std::string& clock, ClockError error);

}  // namespace ftcs::daemon
