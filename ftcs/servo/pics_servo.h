// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ftcs/servo/sample_progress.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

/// Parameters of the incremental PI clock servo; the names in brackets are the paper's.
struct PicsConfig {
  /// [T] Interval between samples in reference time. Zero: measured, so that the first command
  /// comes with the second sample.
  Nanoseconds sync_interval{0};
  /// [k_p k_c T] Dimensionless; 1 is the paper's optimum (Table 3). Stable: 0 < K_p < 2.
  double proportional_gain = 1.0;
  /// [k_i k_c T] Dimensionless; 1 is the paper's optimum (Table 3). Stable: 0 < K_i < 4 - 2 K_p.
  double integral_gain = 1.0;
  /// e(-1): equal to e(0) when false (no proportional kick at the start), zero when true.
  bool previous_error_starts_at_zero = false;
  /// [a_l(0)] What the clock runs at before the first command.
  Rate initial_rate{};
  /// [F] Limits of the local rate, local per free running.
  RateLimits limits{};
  /// A measured ratio outside is a jump of one of the clocks: the sample never steers.
  RateLimits plausible_ratio{};
};

/// The first thing that is wrong: kSyncInterval, kProportionalGain, kIntegralGain (negative or not
/// finite), kRateLimits, kPlausibleRatio. Gains that are unstable are not refused.
[[nodiscard]] std::optional<ServoConfigError> validate(const PicsConfig& config) noexcept;

/// The PI clock servo that the paper compares with (PICS, eq. 26), in incremental form with
/// normalised gains:
///
///     a_l(n+1) = a_l(n) + [K_p (e(n) - e(n-1)) + K_i e(n)] / T,   e = T_offset = -offset
///
/// A closed loop on the steered clock. The limited rate is its only integrator, so that it cannot
/// wind up. Holds its rate until the next sample (no correction that expires). Acts on its first
/// sample. Never steps.
///
/// The error follows e(n+1) = (2 - K_p - K_i) e(n) - (1 - K_p) e(n-1): with both gains 1 it is gone
/// after two intervals (deadbeat), with smaller ones noise is averaged and a start takes longer. A
/// lost message leaves the last rate on for another interval, correction included.
///
/// The sample's offset is used as it is, without projection to the moment of the command.
class PicsServo {
 public:
  using Config = PicsConfig;

  /// Valid: validate(config) finds nothing; it is not asked here.
  explicit PicsServo(const PicsConfig& config = {}) noexcept
      : config_(config), rate_(config.limits.clamp(config.initial_rate)) {}

  /// kUsed: a command (none with the first sample, if the interval is to be measured). kDuplicate:
  /// nothing has changed. kImplausible: reset(), and the sample is left out.
  ServoUpdate update(const SyncSample& sample, const ClockReading& now) noexcept;
  /// Forgets e(n-1); keeps the rate, because it belongs to the oscillator more than to the
  /// reference.
  void reset() noexcept {
    has_previous_ = false;
    snapshot_.state = ServoState::kUnlocked;
  }
  /// The clock has been stepped by somebody else: e(n-1) moves along.
  void on_step(Duration step) noexcept { previous_error_ -= step; }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  PicsConfig config_;
  Rate rate_;
  bool has_previous_ = false;
  SampleInstant previous_{};
  Duration previous_error_{};
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<PicsServo>);

}  // namespace ftcs
