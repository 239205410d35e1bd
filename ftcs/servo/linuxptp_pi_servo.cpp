// SPDX-License-Identifier: MIT
#include "ftcs/servo/linuxptp_pi_servo.h"

#include <algorithm>
#include <cmath>

namespace ftcs {
namespace {

// ptp4l(8): the scales that stand for "0.0", and what caps a gain given as a constant (per second
// of T).
constexpr double kHardwareProportionalScale = 0.7;
constexpr double kHardwareIntegralScale = 0.3;
constexpr double kSoftwareProportionalScale = 0.1;
constexpr double kSoftwareIntegralScale = 0.001;
constexpr double kProportionalConstNormMax = 1.0;
constexpr double kIntegralConstNormMax = 2.0;

// The first frequency comes from two samples 0.016/ki seconds apart: the smaller the integral gain,
// the longer a wrong first frequency would stay, so the better it has to be.
constexpr double kEstimationGainSeconds = 0.016;
constexpr double kMaxEstimationSeconds = 1000.0;

double capped_gain(double scale, double exponent, double norm_max, double interval_s) noexcept {
  return std::min(scale * std::pow(interval_s, exponent), norm_max / interval_s);
}

bool usable(double gain) noexcept { return gain >= 0.0 && std::isfinite(gain); }

}  // namespace

std::optional<ServoConfigError> validate(const LinuxptpPiConfig& config) noexcept {
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  if (!usable(config.proportional_const) || !usable(config.proportional_scale) ||
      !usable(config.proportional_norm_max) || !std::isfinite(config.proportional_exponent)) {
    return ServoConfigError::kProportionalGain;
  }
  if (!usable(config.integral_const) || !usable(config.integral_scale) ||
      !usable(config.integral_norm_max) || !std::isfinite(config.integral_exponent)) {
    return ServoConfigError::kIntegralGain;
  }
  if (config.first_step_threshold < Nanoseconds{0} || config.step_threshold < Nanoseconds{0}) {
    return ServoConfigError::kStepThreshold;
  }
  const bool limits_valid =
      config.limits.valid() && RateLimits::symmetric_ppb(config.max_frequency_ppb).valid();
  if (!limits_valid) return ServoConfigError::kRateLimits;
  return std::nullopt;
}

PiGains linuxptp_gains(const LinuxptpPiConfig& config, double interval_s) noexcept {
  const bool hardware = config.timestamping == TimestampingKind::kHardware;
  const double proportional_preset =
      hardware ? kHardwareProportionalScale : kSoftwareProportionalScale;
  const double integral_preset = hardware ? kHardwareIntegralScale : kSoftwareIntegralScale;
  PiGains gains;
  gains.proportional =
      config.proportional_const > 0.0
          ? capped_gain(config.proportional_const, 0.0, kProportionalConstNormMax, interval_s)
          : capped_gain(
                config.proportional_scale > 0.0 ? config.proportional_scale : proportional_preset,
                config.proportional_exponent, config.proportional_norm_max, interval_s);
  gains.integral =
      config.integral_const > 0.0
          ? capped_gain(config.integral_const, 0.0, kIntegralConstNormMax, interval_s)
          : capped_gain(config.integral_scale > 0.0 ? config.integral_scale : integral_preset,
                        config.integral_exponent, config.integral_norm_max, interval_s);
  return gains;
}

LinuxptpPiServo::LinuxptpPiServo(const LinuxptpPiConfig& config) noexcept
    : config_(config),
      limits_(intersect(config.limits, RateLimits::symmetric_ppb(config.max_frequency_ppb))) {
  if (config.sync_interval > Nanoseconds{0}) {
    gains_ = linuxptp_gains(config, Duration{config.sync_interval}.seconds());
  }
}

void LinuxptpPiServo::reset() noexcept {
  phase_ = Phase::kEmpty;
  has_previous_ = false;
  snapshot_.state = ServoState::kUnlocked;
}

ServoUpdate LinuxptpPiServo::update(const SyncSample& sample, const ClockReading&) noexcept {
  if (has_previous_ && sample.free_running - previous_.free_running <= Duration{}) {
    return {SampleVerdict::kDuplicate, false, {}};
  }
  snapshot_.offset = sample.offset();
  snapshot_.path_delay = sample.path_delay;
  ServoUpdate update;
  switch (phase_) {
    case Phase::kEmpty:
      first_ = sample;
      phase_ = Phase::kEstimating;
      break;
    case Phase::kEstimating:
      update = estimate_frequency(sample);
      break;
    case Phase::kRunning:
      update = run(sample);
      break;
  }
  previous_ = sample;
  has_previous_ = true;
  return update;
}

ServoUpdate LinuxptpPiServo::estimate_frequency(const SyncSample& sample) noexcept {
  const Duration reference_elapsed = sample.reference() - first_.reference();
  if (reference_elapsed <= Duration{}) {
    first_ = sample;  // the reference went backward: a new start
    return {SampleVerdict::kImplausible, false, {}};
  }
  if (config_.sync_interval == Nanoseconds{0} && first_.free_running == previous_.free_running) {
    gains_ = linuxptp_gains(config_, reference_elapsed.seconds());
  }
  const double needed_s = std::min(kEstimationGainSeconds / gains_.integral, kMaxEstimationSeconds);
  if ((sample.local - first_.local).seconds() < needed_s) return {};

  // Free-running time does not know our own commands, so that no rate in use has to be divided out.
  const Duration elapsed = sample.free_running - first_.free_running;
  const Rate rate = limits_.clamp(Rate::from_ratio(reference_elapsed.ns() / elapsed.ns()));
  drift_ppb_ = -rate.ppb();
  phase_ = Phase::kRunning;
  snapshot_.rate_ratio = rate;

  const Duration offset = sample.offset();
  const Nanoseconds first_threshold = first_lock_ ? config_.first_step_threshold : Nanoseconds{0};
  const bool jump =
      (first_threshold > Nanoseconds{0} && abs(offset) > Duration{first_threshold}) ||
      (config_.step_threshold > Nanoseconds{0} && abs(offset) > Duration{config_.step_threshold});
  first_lock_ = false;
  snapshot_.state = jump ? ServoState::kJump : ServoState::kLocked;
  return {SampleVerdict::kUsed, true, {rate, Duration{}, rate, jump ? -offset : Duration{}}};
}

ServoUpdate LinuxptpPiServo::run(const SyncSample& sample) noexcept {
  const Duration offset = sample.offset();
  if (config_.step_threshold > Nanoseconds{0} && abs(offset) > Duration{config_.step_threshold}) {
    reset();
    return {};
  }
  const double integral_ppb = gains_.integral * offset.ns();
  const Rate wanted =
      Rate::from_ppb(-(gains_.proportional * offset.ns() + drift_ppb_ + integral_ppb));
  const Rate rate = limits_.clamp(wanted);
  // A limited frequency does not follow the integrator: frozen, it cannot wind up.
  if (rate == wanted) drift_ppb_ += integral_ppb;
  snapshot_.state = ServoState::kLocked;
  snapshot_.rate_ratio = Rate::from_ppb(-drift_ppb_);
  return {SampleVerdict::kUsed, true, {rate, Duration{}, rate, Duration{}}};
}

}  // namespace ftcs
