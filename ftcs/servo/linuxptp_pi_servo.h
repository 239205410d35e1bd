// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

/// Who stamps: ptp4l's time_stamping, as far as its servo asks.
enum class TimestampingKind : std::uint8_t { kHardware, kSoftware };

/// Options of ptp4l's PI servo under its documented names (ptp4l(8), pi_*), with its defaults.
/// A constant or a scale of zero means "not given", as there.
struct LinuxptpPiConfig {
  /// T. Zero: measured between the first two samples after a start.
  Nanoseconds sync_interval{0};
  /// Chooses the scales when they are zero: 0.7 and 0.3 for hardware stamps, 0.1 and 0.001 for
  /// software.
  TimestampingKind timestamping = TimestampingKind::kHardware;
  // kp of T seconds is scale T^exponent, at most norm_max / T; or const, at most 1 / T. In 1/s.
  double proportional_const = 0.0;
  double proportional_scale = 0.0;
  double proportional_exponent = -0.3;
  double proportional_norm_max = 0.7;
  // ki likewise; its const is capped at 2 / T.
  double integral_const = 0.0;
  double integral_scale = 0.0;
  double integral_exponent = 0.4;
  double integral_norm_max = 0.3;
  /// Steps larger offsets, but only at the very first lock. Zero: never.
  Nanoseconds first_step_threshold{20'000};
  /// Starts again (and steps) whenever an offset is larger. Zero: never.
  Nanoseconds step_threshold{0};
  /// Largest frequency adjustment; the narrower of this and `limits` holds.
  double max_frequency_ppb = 900'000'000.0;
  RateLimits limits{};
};

/// The first thing that is wrong: kSyncInterval, kProportionalGain, kIntegralGain, kStepThreshold
/// (negative), kRateLimits (limits, or max_frequency_ppb outside [0, 1e9)).
[[nodiscard]] std::optional<ServoConfigError> validate(const LinuxptpPiConfig& config) noexcept;

/// Gains for one interval. The loop of ppb and ns is stable for kp T < 2 and ki T < 4 - 2 kp T.
struct PiGains {
  double proportional = 0.0;  ///< kp, 1/s: ppb of frequency per ns of offset
  double integral = 0.0;      ///< ki, 1/s per sample
};

/// kp = min(scale T^exponent, norm_max / T), ki likewise, T in seconds, as ptp4l(8) gives them. A
/// constant takes the place of scale T^exponent and is capped at 1/T (kp) or 2/T (ki). Valid:
/// interval_s > 0. With the defaults and T = 1 s: kp 0.7, ki 0.3.
[[nodiscard]] PiGains linuxptp_gains(const LinuxptpPiConfig& config, double interval_s) noexcept;

/// A PI servo that behaves as linuxptp's does (its documented behaviour; independent code), so that
/// users can compare and change over without surprise. Offsets in ns, frequencies in ppb:
///
///     frequency = kp offset + drift + ki offset,   rate = 1 - frequency
///     drift += ki offset, unless the frequency is limited
///
/// s0 until two samples at least 0.016/ki s apart (at most 1000 s) have given a first frequency;
/// then s1 (a step) or s2, according to the thresholds. Holds its rate until the next sample. The
/// sample's offset is used as it is, without projection to the moment of the command.
class LinuxptpPiServo {
 public:
  using Config = LinuxptpPiConfig;

  explicit LinuxptpPiServo(const LinuxptpPiConfig& config = {}) noexcept;

  /// A step, where one is due, is in the command: whoever applies it decides whether it may be
  /// (StepPolicy). kDuplicate: not newer on the oscillator. kImplausible: the reference went
  /// backward during s0.
  ServoUpdate update(const SyncSample& sample, const ClockReading& now) noexcept;
  /// Back to s0. The drift stays in use until two samples have given a new one; a first step is not
  /// repeated.
  void reset() noexcept;
  /// A clock was set back. The original goes on: an offset is an offset, whatever made it. Only a
  /// frequency that is still being measured begins anew.
  void on_new_epoch() noexcept {
    has_previous_ = false;
    if (phase_ == Phase::kEstimating) phase_ = Phase::kEmpty;
  }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }
  /// Zero until the interval is known.
  [[nodiscard]] PiGains gains() const noexcept { return gains_; }

 private:
  enum class Phase : std::uint8_t { kEmpty, kEstimating, kRunning };

  ServoUpdate estimate_frequency(const SyncSample& sample) noexcept;
  ServoUpdate run(const SyncSample& sample) noexcept;

  LinuxptpPiConfig config_;
  RateLimits limits_;
  PiGains gains_{};
  Phase phase_ = Phase::kEmpty;
  bool first_lock_ = true;
  double drift_ppb_ = 0.0;
  SyncSample first_{};
  bool has_previous_ = false;
  SyncSample previous_{};
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<LinuxptpPiServo>);

}  // namespace ftcs
