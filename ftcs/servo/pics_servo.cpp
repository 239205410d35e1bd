// SPDX-License-Identifier: MIT
#include "ftcs/servo/pics_servo.h"

#include <cmath>

namespace ftcs {

std::optional<ServoConfigError> validate(const PicsConfig& config) noexcept {
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  if (!(config.proportional_gain >= 0.0 && std::isfinite(config.proportional_gain))) {
    return ServoConfigError::kProportionalGain;
  }
  if (!(config.integral_gain >= 0.0 && std::isfinite(config.integral_gain))) {
    return ServoConfigError::kIntegralGain;
  }
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  if (!config.plausible_ratio.valid()) return ServoConfigError::kPlausibleRatio;
  return std::nullopt;
}

ServoUpdate PicsServo::update(const SyncSample& sample, const ClockReading&) noexcept {
  const Duration error = -sample.offset();
  Duration interval = config_.sync_interval;
  if (has_previous_) {
    const SampleProgress progress = progress_between(previous_, sample, config_.plausible_ratio);
    if (progress.verdict == SampleVerdict::kDuplicate) return {progress.verdict, false, {}};
    if (progress.verdict == SampleVerdict::kImplausible) {
      reset();  // with e(n-1) of a clock that jumped, the proportional part would kick
      return {progress.verdict, false, {}};
    }
    if (config_.sync_interval == Nanoseconds{0}) interval = progress.reference;
  } else {
    previous_error_ = config_.previous_error_starts_at_zero ? Duration{} : error;
  }
  const Duration change = error - previous_error_;
  previous_ = instant_of(sample);
  has_previous_ = true;
  previous_error_ = error;
  snapshot_.offset = sample.offset();
  snapshot_.path_delay = sample.path_delay;
  if (interval == Duration{}) return {};  // to be measured, and this is the first sample

  const double correction =
      config_.proportional_gain * change.ns() + config_.integral_gain * error.ns();
  rate_ = config_.limits.clamp(Rate::from_ratio(rate_.ratio() + correction / interval.ns()));
  snapshot_.state = ServoState::kLocked;
  snapshot_.rate_ratio = rate_;
  return {SampleVerdict::kUsed, true, {rate_, Duration{}, rate_, Duration{}}};
}

}  // namespace ftcs
