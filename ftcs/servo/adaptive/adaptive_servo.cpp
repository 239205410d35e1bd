// SPDX-License-Identifier: MIT
#include "ftcs/servo/adaptive/adaptive_servo.h"

#include <cmath>
#include <memory>

namespace ftcs {
namespace {

using adaptive::Estimate;
using adaptive::Observation;

/// T_c as a part of the sync interval: shorter follows changes more closely, at the price of
/// larger rate swings; below a quarter little is gained.
constexpr double kCorrectionShare = 0.25;

adaptive::KnownDelay known_delay(const AdaptiveConfig& config) noexcept {
  if (!config.fixed_path_delay.has_value()) return {};
  return {static_cast<double>(config.fixed_path_delay->count()),
          static_cast<double>(config.path_delay_sigma.count())};
}

double sign_of(Direction direction) noexcept {
  return direction == Direction::kForward ? 1.0 : -1.0;
}
std::size_t index_of(Direction direction) noexcept {
  return direction == Direction::kForward ? 0 : 1;
}

}  // namespace

std::optional<ServoConfigError> validate(const AdaptiveConfig& config) noexcept {
  const SteeringLimits& steering = config.steering;
  const Nanoseconds none{0};
  if (config.sync_interval < none) return ServoConfigError::kSyncInterval;
  if (!steering.rate.valid()) return ServoConfigError::kRateLimits;
  const bool possible = std::isfinite(steering.rate_change) && steering.rate_change >= 0.0 &&
                        std::isfinite(steering.rate_granularity) &&
                        steering.rate_granularity >= 0.0 && steering.time_granularity >= none &&
                        steering.latency >= none && config.path_delay_sigma >= none;
  if (!possible) return ServoConfigError::kActuator;
  return std::nullopt;
}

template <class Grid, std::size_t Window>
BasicAdaptiveServo<Grid, Window>::BasicAdaptiveServo(const AdaptiveConfig& config) noexcept
    : config_(config), estimator_(known_delay(config)), steering_(config.steering) {
  reset();
}

template <class Grid, std::size_t Window>
void BasicAdaptiveServo<Grid, Window>::reset() noexcept {
  // In place: a temporary would be kilobytes on the stack.
  std::construct_at(&estimator_, known_delay(config_));
  steering_.reset();
  interval_ns_ = static_cast<double>(config_.sync_interval.count());
  interval_known_ = interval_ns_ > 0.0;
  if (!interval_known_) interval_ns_ = 1e9;
  started_ = false;
  has_latest_[0] = has_latest_[1] = false;
  snapshot_ = ServoSnapshot{};
}

template <class Grid, std::size_t Window>
SampleVerdict BasicAdaptiveServo<Grid, Window>::check_order(const TimestampPair& pair) noexcept {
  const std::size_t side = index_of(pair.direction);
  if (!has_latest_[side]) return SampleVerdict::kUsed;
  const TimestampPair& previous = latest_[side];
  const bool reference_newer = pair.reference > previous.reference;
  const bool local_newer = pair.free_running > previous.free_running;
  if (reference_newer && local_newer) return SampleVerdict::kUsed;
  return reference_newer || local_newer ? SampleVerdict::kImplausible : SampleVerdict::kDuplicate;
}

/// Without a configured interval the unit of time is provisional until two messages of the same
/// direction have been seen.
template <class Grid, std::size_t Window>
void BasicAdaptiveServo<Grid, Window>::measure_interval(const TimestampPair& pair,
                                                        bool had_previous) noexcept {
  if (interval_known_ || !had_previous) return;
  const std::size_t side = index_of(pair.direction);
  const double measured = (pair.reference - latest_[side].reference).ns();
  estimator_.rescale_time(measured / interval_ns_);
  interval_ns_ = measured;
  interval_known_ = true;
}

template <class Grid, std::size_t Window>
Observation BasicAdaptiveServo<Grid, Window>::observe(const TimestampPair& pair) noexcept {
  const double sign = sign_of(pair.direction);
  const Duration raw = pair.free_running.since_epoch() - pair.reference.since_epoch();
  const ReferenceTime event = pair.reference + Duration::from_ns(sign * estimator_.estimate().d);
  Observation seen;
  seen.sign = sign;
  if (!started_) {
    base_ = raw;
    started_ = true;
  } else {
    seen.elapsed = (event - event_).ns() / interval_ns_;
  }
  seen.z = (raw - base_).ns();
  event_ = event;
  return seen;
}

template <class Grid, std::size_t Window>
bool BasicAdaptiveServo<Grid, Window>::ready() const noexcept {
  if (config_.fixed_path_delay.has_value()) return estimator_.count() >= 2;
  return estimator_.count() >= (estimator_.two_way() ? 3U : 4U);
}

template <class Grid, std::size_t Window>
ServoUpdate BasicAdaptiveServo<Grid, Window>::update(const TimestampPair& pair,
                                                     const ClockReading& now) noexcept {
  const SampleVerdict order = check_order(pair);
  if (order != SampleVerdict::kUsed) return {order, false, {}};
  const std::size_t side = index_of(pair.direction);
  measure_interval(pair, has_latest_[side]);
  latest_[side] = pair;
  has_latest_[side] = true;
  const double credit = estimator_.update(pair.direction, observe(pair));
  ServoUpdate result;
  if (ready()) result = steer(now);
  result.verdict = credit < 0.5 ? SampleVerdict::kRejected : SampleVerdict::kUsed;
  return result;
}

/// r = 1 + y: free running per reference. The estimate says that the free-running clock showed
/// F_e = event + base + x at the event; so the reference now is event + (F_now - F_e) / r.
template <class Grid, std::size_t Window>
ServoUpdate BasicAdaptiveServo<Grid, Window>::steer(const ClockReading& now) noexcept {
  const Estimate& e = estimator_.estimate();
  const double y = e.y / interval_ns_;
  const double r = 1.0 + y;
  const Duration since_event = now.free_running.since_epoch() - event_.since_epoch() - base_;
  const double elapsed_free = since_event.ns() - e.x;  // F_now - F_e
  const ReferenceTime reference_now =
      event_ + since_event - Duration::from_ns(e.x + elapsed_free * (y / r));
  const double offset_ns = offset_from_reference(now.local, reference_now).ns();
  const adaptive::Steered steered =
      steering_.steer({offset_ns, r}, kCorrectionShare * interval_ns_);
  snapshot_.state = steered.stepped ? ServoState::kJump : ServoState::kLocked;
  publish(offset_ns);
  return {SampleVerdict::kUsed, true, steered.command};
}

template <class Grid, std::size_t Window>
void BasicAdaptiveServo<Grid, Window>::publish(double offset_ns) noexcept {
  const Estimate& e = estimator_.estimate();
  const double s = estimator_.scale();
  snapshot_.offset_known = true;
  snapshot_.offset = Duration::from_ns(offset_ns);
  snapshot_.path_delay = Duration::from_ns(e.d);
  snapshot_.rate_ratio = Rate::from_ratio(1.0 / (1.0 + e.y / interval_ns_));
  snapshot_.offset_gain = estimator_.gain();
  snapshot_.offset_sigma_ns = s * std::sqrt(e.xx);
  snapshot_.rate_sigma_ppb = s * std::sqrt(e.yy) / interval_ns_ * 1e9;
  snapshot_.path_delay_sigma_ns = s * std::sqrt(e.dd);
  snapshot_.timestamp_noise_ns = s;
}

template class BasicAdaptiveServo<adaptive::FullGrid, 32>;

}  // namespace ftcs
