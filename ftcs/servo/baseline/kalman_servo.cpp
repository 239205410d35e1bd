// SPDX-License-Identifier: MIT
#include "ftcs/servo/baseline/kalman_servo.h"

#include <cmath>

namespace ftcs {
namespace {

double interval_ns(const KalmanConfig& config) noexcept {
  return config.sync_interval > Nanoseconds{0} ? static_cast<double>(config.sync_interval.count())
                                               : 1e9;
}

SteeringLimits steering_limits(const KalmanConfig& config) noexcept {
  SteeringLimits limits;
  limits.rate = config.limits;
  return limits;
}

}  // namespace

std::optional<ServoConfigError> validate(const KalmanConfig& config) noexcept {
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  if (!(config.correction_share > 0.0 && config.correction_share <= 1.0)) {
    return ServoConfigError::kCorrectionTime;
  }
  const baseline::KalmanNoise& noise = config.noise;
  const bool possible = std::isfinite(noise.forward_ns) && noise.forward_ns > 0.0 &&
                        std::isfinite(noise.backward_ns) && noise.backward_ns > 0.0 &&
                        std::isfinite(noise.white_fm_1s) && noise.white_fm_1s >= 0.0 &&
                        std::isfinite(noise.random_walk_fm_1s) && noise.random_walk_fm_1s >= 0.0;
  if (!possible) return ServoConfigError::kNoise;
  return std::nullopt;
}

KalmanServo::KalmanServo(const KalmanConfig& config) noexcept
    : config_(config),
      filter_(config.noise, config.fixed_path_delay.has_value()),
      steering_(steering_limits(config)) {
  if (config.fixed_path_delay)
    known_delay_ns_ = static_cast<double>(config.fixed_path_delay->count());
}

void KalmanServo::observe(const TimestampPair& pair) noexcept {
  const double sign = pair.direction == Direction::kForward ? 1.0 : -1.0;
  const Duration raw = pair.free_running.since_epoch() - pair.reference.since_epoch();
  const double delay_ns = known_delay_ns_ + filter_.state().d;
  const ReferenceTime event = pair.reference + Duration::from_ns(sign * delay_ns);
  if (messages_ == 0) {
    base_ = raw;
    event_ = event;
  }
  const double elapsed_s = (event - event_).seconds();
  filter_.update(elapsed_s, sign, (raw - base_).ns() - sign * known_delay_ns_);
  event_ = event;
  ++messages_;
}

/// The filter says that the oscillator showed F_e = event + base + x at the event, and runs at r =
/// 1 + y.
ServoUpdate KalmanServo::steer(const ClockReading& now) noexcept {
  const double y = filter_.state().y * 1e-9;
  const double r = 1.0 + y;
  const Duration since_event = now.free_running.since_epoch() - event_.since_epoch() - base_;
  const double elapsed_free_ns = since_event.ns() - filter_.state().x;
  const ReferenceTime reference_now =
      event_ + since_event - Duration::from_ns(filter_.state().x + elapsed_free_ns * (y / r));
  const double offset_ns = offset_from_reference(now.local, reference_now).ns();
  const auto steered =
      steering_.steer({offset_ns, r}, config_.correction_share * interval_ns(config_));
  snapshot_.state = ServoState::kLocked;
  snapshot_.offset_known = true;
  snapshot_.offset = Duration::from_ns(offset_ns);
  snapshot_.path_delay = Duration::from_ns(known_delay_ns_ + filter_.state().d);
  snapshot_.rate_ratio = Rate::from_ratio(1.0 / r);
  snapshot_.offset_gain = filter_.gain();
  snapshot_.offset_sigma_ns = filter_.offset_sigma_ns();
  snapshot_.rate_sigma_ppb = filter_.rate_sigma_ppb();
  snapshot_.path_delay_sigma_ns = filter_.delay_sigma_ns();
  snapshot_.timestamp_noise_ns = config_.noise.forward_ns;
  return {SampleVerdict::kUsed, true, steered.command};
}

ServoUpdate KalmanServo::update(const TimestampPair& pair, const ClockReading& now) noexcept {
  if (config_.fixed_path_delay && pair.direction == Direction::kBackward) return {};
  heard_[pair.direction] = true;
  observe(pair);
  // Two messages of a known delay, or three with both directions, determine all states.
  const bool determined = config_.fixed_path_delay
                              ? messages_ >= 2
                              : messages_ >= 3 && heard_.forward && heard_.backward;
  return determined ? steer(now) : ServoUpdate{};
}

}  // namespace ftcs
