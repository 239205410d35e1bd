// SPDX-License-Identifier: MIT
#include "ftcs/servo/adaptive/adaptive_servo.h"

#include <algorithm>
#include <cmath>

namespace ftcs {
namespace {

using estimation::Estimate;
using estimation::Observation;

/// T_c as a part of the sync interval: shorter follows changes more closely (frequency steps of 1
/// ppm every 50 s: 182 ns at a quarter, 173 at an eighth, 170 at a twelfth), at the price of larger
/// rate swings.
constexpr double kCorrectionShare = 0.125;
/// A clock half as fast or one and a half times as fast as the other is broken.
constexpr double kPlausibleDeviation = 0.5;
/// 2^40 ns, 18 minutes: resolved to 2^-12 ns.
constexpr double kLargestOffsetNs = 1099511627776.0;

estimation::KnownDelay known_delay(const AdaptiveConfig& config) noexcept {
  if (!config.fixed_path_delay.has_value()) return {};
  return {static_cast<double>(config.fixed_path_delay->count()),
          static_cast<double>(config.path_delay_sigma.count())};
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
  if (config.learnt && !config.learnt->valid()) return ServoConfigError::kLearntState;
  return std::nullopt;
}

template <class Grid>
BasicAdaptiveServo<Grid>::BasicAdaptiveServo(const AdaptiveConfig& config) noexcept
    : sync_interval_(config.sync_interval),
      estimator_(known_delay(config)),
      steering_(config.steering) {
  reset();
  if (config.learnt) {
    rate_expected_ = true;
    const double cycle = meter_.interval_ns();
    estimator_.expect({config.learnt->rate_deviation * cycle, config.learnt->rate_sigma * cycle},
                      config.learnt->timestamp_noise_ns);
  }
}

template <class Grid>
void BasicAdaptiveServo<Grid>::reset() noexcept {
  estimator_.fix_delay();
  forget();
  steering_.reset();
  latest_ = Belief{};
  state_ = ServoState::kUnlocked;
}

template <class Grid>
void BasicAdaptiveServo<Grid>::forget() noexcept {
  estimator_.restart();
  meter_ = estimation::IntervalMeter{static_cast<double>(sync_interval_.count())};
  ticks_ = {};
  started_ = false;
  rate_expected_ = false;
}

/// A message belongs to the moment of its reference stamp. A path of D reference ns then adds
/// sign D r, r = free running per reference, exactly: d = D r is the constant that the filters see,
/// and no time depends on an estimate. A delay known in reference time shifts the moment instead.
/// Time passes by the reference, always: where a clock has leapt the offset is estimated anew, and
/// what a host held up for seconds looks the same.
template <class Grid>
Observation BasicAdaptiveServo<Grid>::observe(const TimestampPair& pair) noexcept {
  const double sign = sign_of(pair.direction);
  const Duration raw = pair.free_running.since_epoch() - pair.reference.since_epoch();
  const estimation::KnownDelay known = estimator_.known_delay();
  const double shift = known.known() ? sign * known.mean_ns : 0.0;
  const ReferenceTime event = pair.reference + Duration::from_ns(shift);
  Observation seen;
  seen.sign = sign;
  if (!started_) {
    base_ = raw;
    started_ = true;
  } else {
    seen.elapsed = (event - event_).ns() / meter_.interval_ns();
  }
  seen.z = (raw - base_).ns();
  event_ = event;
  return seen;
}

/// Keeps the offset states so small that a double resolves them to well below a nanosecond. An
/// offset that is known to 18 minutes at best loses nothing if the message is kept so small
/// instead.
template <class Grid>
void BasicAdaptiveServo<Grid>::rebase(double z) noexcept {
  const double x = estimator_.estimate().x;
  if (std::max(std::abs(x), std::abs(z)) < kLargestOffsetNs) return;
  const double far = estimator_.offset_sigma_ns(0.0) > kLargestOffsetNs ? z : x;
  if (std::abs(far) < kLargestOffsetNs) return;
  const Duration shift = Duration::from_ns(far);
  base_ += shift;
  estimator_.shift_offset(-shift.ns());
}

template <class Grid>
bool BasicAdaptiveServo<Grid>::ready() const noexcept {
  if (state_ == ServoState::kUnlocked && !rate_expected_ && !meter_.tells_rate()) return false;
  if (estimator_.known_delay().known()) return estimator_.count() >= 2;
  return estimator_.count() >= (estimator_.two_way() ? 3U : 4U);
}

template <class Grid>
ServoUpdate BasicAdaptiveServo<Grid>::update(const TimestampPair& pair,
                                             const ClockReading& now) noexcept {
  ticks_.observe(pair);
  const double longer = meter_.observe(pair);
  if (longer != 1.0) estimator_.rescale_time(longer);
  estimator_.expect_noise_of_at_least(ticks_.rounding_ns());
  Observation seen = observe(pair);
  double credit = estimator_.update(seen);
  if (estimator_.count() == 0) {  // it has given up: this message is the first
    started_ = false;
    seen = observe(pair);
    credit = estimator_.update(seen);
  }
  rebase(seen.z);
  ServoUpdate result;
  if (ready()) result = steer(now);
  result.verdict = credit < 0.5 ? SampleVerdict::kRejected : SampleVerdict::kUsed;
  return result;
}

/// r = 1 + y: free running per reference. The estimate says that the free-running clock showed
/// F_e = event + base + x at the event; so the reference now is event + (F_now - F_e) / r.
template <class Grid>
typename BasicAdaptiveServo<Grid>::Belief BasicAdaptiveServo<Grid>::believe(
    const ClockReading& now) const noexcept {
  const Estimate& e = estimator_.estimate();
  Belief belief;
  belief.rate_deviation = e.y / meter_.interval_ns();
  const double r = 1.0 + belief.rate_deviation;
  const Duration since_event = now.free_running.since_epoch() - event_.since_epoch() - base_;
  const double elapsed_free = since_event.ns() - e.x;  // F_now - F_e
  const ReferenceTime reference_now =
      event_ + since_event - Duration::from_ns(e.x + elapsed_free * (belief.rate_deviation / r));
  belief.offset_ns = offset_from_reference(now.local, reference_now).ns();
  belief.cycles = elapsed_free / r / meter_.interval_ns();
  return belief;
}

template <class Grid>
ServoUpdate BasicAdaptiveServo<Grid>::steer(const ClockReading& now) noexcept {
  const Belief belief = believe(now);
  // Before the rate is known, or on nonsense: no command is better than any.
  if (!(std::abs(belief.rate_deviation) < kPlausibleDeviation)) return {};
  const adaptive::Steered steered = steering_.steer({belief.offset_ns, 1.0 + belief.rate_deviation},
                                                    kCorrectionShare * meter_.interval_ns());
  state_ = steered.stepped ? ServoState::kJump : ServoState::kLocked;
  latest_ = belief;
  return {SampleVerdict::kUsed, true, steered.command};
}

template <class Grid>
ServoSnapshot BasicAdaptiveServo<Grid>::describe(const Belief& belief,
                                                 ServoState state) const noexcept {
  ServoSnapshot snapshot;
  snapshot.state = state;
  if (state == ServoState::kUnlocked) return snapshot;
  snapshot.offset_known = true;
  snapshot.offset = Duration::from_ns(belief.offset_ns);
  const double free_per_reference =
      estimator_.known_delay().known() ? 1.0 : 1.0 + belief.rate_deviation;
  snapshot.path_delay = Duration::from_ns(estimator_.estimate().d / free_per_reference);
  snapshot.rate_ratio = Rate::from_ratio(1.0 / (1.0 + belief.rate_deviation));
  snapshot.offset_gain = estimator_.gain();
  const double sigma = estimator_.offset_sigma_ns(belief.cycles);
  const double noise =
      std::min(estimator_.noise_ns(Direction::kForward), estimator_.noise_ns(Direction::kBackward));
  snapshot.offset_sigma_ns = std::sqrt(sigma * sigma + ticks_.hidden_ns2(noise));
  snapshot.rate_sigma_ppb = estimator_.rate_sigma_ns() / meter_.interval_ns() * 1e9;
  snapshot.path_delay_sigma_ns = estimator_.delay_sigma_ns();
  snapshot.timestamp_noise_ns = estimator_.scale();
  return snapshot;
}

template <class Grid>
ServoSnapshot BasicAdaptiveServo<Grid>::snapshot_at(const ClockReading& now) const noexcept {
  if (state_ == ServoState::kUnlocked) return snapshot();
  Belief belief = believe(now);
  belief.rate_deviation = latest_.rate_deviation;
  return describe(belief, state_);
}

template class BasicAdaptiveServo<estimation::FullGrid>;
template class BasicAdaptiveServo<estimation::SmallGrid>;

}  // namespace ftcs
