// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <optional>

#include "ftcs/servo/sample_progress.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

struct PidConfig {
  Nanoseconds sync_interval{0};  ///< zero: measured
  // Dimensionless, normalised by the interval as PICS's. Defaults: the proportional and integral
  // part of PICS2, the quietest row of the paper's Table 2, and a derivative part that damps it.
  double proportional_gain = 0.5;
  double integral_gain = 0.3;
  double derivative_gain = 0.1;
  RateLimits limits{};
};

/// The first thing that is wrong; kProportionalGain stands for the derivative gain too.
[[nodiscard]] inline std::optional<ServoConfigError> validate(const PidConfig& config) noexcept {
  const auto possible = [](double gain) { return std::isfinite(gain) && gain >= 0.0; };
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  if (!possible(config.proportional_gain)) return ServoConfigError::kProportionalGain;
  if (!possible(config.integral_gain)) return ServoConfigError::kIntegralGain;
  if (!possible(config.derivative_gain)) return ServoConfigError::kProportionalGain;
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  return std::nullopt;
}

/// Baseline: a PID clock servo (Fan et al. [21]) in incremental form with normalised gains, e =
/// -offset:
///
///   a(n+1) = a(n) + [K_p (e(n) - e(n-1)) + K_i e(n) + K_d (e(n) - 2 e(n-1) + e(n-2))] / T
///
/// Acts on its first sample if the interval is configured. After an implausible one it begins anew,
/// at the rate that it has: with errors of a clock that jumped, the proportional part would kick.
class PidServo {
 public:
  using Config = PidConfig;

  explicit PidServo(const PidConfig& config = {}) noexcept : config_(config) {}

  ServoUpdate update(const SyncSample& sample, const ClockReading&) noexcept {
    const double error = -sample.offset().ns();
    double interval_ns = static_cast<double>(config_.sync_interval.count());
    if (samples_ > 0) {
      const SampleProgress progress = progress_between(previous_, sample, RateLimits{});
      if (progress.verdict == SampleVerdict::kImplausible) reset();
      if (progress.verdict != SampleVerdict::kUsed) return {progress.verdict, false, {}};
      if (interval_ns == 0.0) interval_ns = progress.reference.ns();
    }
    const double change = samples_ > 0 ? error - last_error_ : 0.0;
    const double bend = samples_ > 1 ? change - last_change_ : 0.0;
    previous_ = sample;
    last_error_ = error;
    last_change_ = change;
    ++samples_;
    snapshot_.offset = sample.offset();
    snapshot_.path_delay = sample.path_delay;
    if (!(interval_ns > 0.0)) return {};
    const double correction = config_.proportional_gain * change + config_.integral_gain * error +
                              config_.derivative_gain * bend;
    rate_ = config_.limits.clamp(Rate::from_ratio(rate_.ratio() + correction / interval_ns));
    snapshot_.state = ServoState::kLocked;
    snapshot_.rate_ratio = rate_;
    return {SampleVerdict::kUsed, true, {rate_, Duration{}, rate_, Duration{}}};
  }
  /// Keeps the rate, because it belongs to the oscillator.
  void reset() noexcept { samples_ = 0; }
  /// The clock has been stepped by somebody else: e(n-1) moves along.
  void on_step(Duration step) noexcept { last_error_ -= step.ns(); }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  PidConfig config_;
  Rate rate_{};
  unsigned samples_ = 0;
  SyncSample previous_{};
  double last_error_ = 0.0;
  double last_change_ = 0.0;
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<PidServo>);

}  // namespace ftcs
