// SPDX-License-Identifier: MIT
#include "ftcs/servo/baseline/minimum_delay_servo.h"

#include <algorithm>
#include <cmath>

namespace ftcs {
namespace {

/// Below it delays count as equal: the resolution of good stamps.
constexpr double kLeastScaleNs = 20.0;
constexpr double kScaleOfExcess = 0.1;
constexpr std::size_t kFewestPoints = 3;
constexpr std::size_t kFewestForRuns = 8;

}  // namespace

std::optional<ServoConfigError> validate(const MinimumDelayConfig& config) noexcept {
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  if (config.window < 1 || config.window > 4096) return ServoConfigError::kWindow;
  return std::nullopt;
}

MinimumDelayServo::Stamp MinimumDelayServo::stamp_of(const TimestampPair& pair) const noexcept {
  const Duration reference = pair.reference - first_.reference;
  const Duration free = pair.free_running - first_.free_running;
  return {reference.ns(), (free - reference).ns()};
}

void MinimumDelayServo::add_exchange(const Stamp& forward, const Stamp& backward) noexcept {
  const double middle = 0.5 * (forward.x + backward.x);
  const double f = forward.y + slope_ * (middle - forward.x);
  const double b = backward.y + slope_ * (middle - backward.x);
  add_point({middle, 0.5 * (f + b), 0.5 * (f - b)});
}

void MinimumDelayServo::add_point(const Point& point) noexcept {
  points_[count_ % kPoints] = point;
  ++count_;
  const std::size_t most = config_.selection == DelaySelection::kWindow ? kWindowPoints : kPoints;
  length_ = std::min(length_ + 1, most);
}

void MinimumDelayServo::add_to_window(const Stamp& forward, const Stamp& backward) noexcept {
  const auto level = [this](const Stamp& stamp) { return stamp.y - slope_ * stamp.x; };
  if (in_window_ == 0 || level(forward) < level(earliest_[0])) earliest_[0] = forward;
  // A backward message that waited has an early-looking free-running stamp.
  if (in_window_ == 0 || level(backward) > level(earliest_[1])) earliest_[1] = backward;
  // The first windows are short, so that there is a rate to take off in the long ones.
  const std::uint32_t size =
      count_ < kWindowPoints ? std::min<std::uint32_t>(config_.window, 2U) : config_.window;
  if (++in_window_ < size) return;
  in_window_ = 0;
  add_exchange(earliest_[0], earliest_[1]);
}

double MinimumDelayServo::weight_of(const Point& point, double least, double scale) const noexcept {
  if (config_.selection == DelaySelection::kWindow) return 1.0;
  const double excess = 1.0 + (point.delay - least) / scale;
  return 1.0 / (excess * excess);
}

bool MinimumDelayServo::fit_line(std::size_t count) noexcept {
  double least = newest(0).delay;
  double mean = 0.0;
  for (std::size_t age = 0; age < count; ++age) {
    least = std::min(least, newest(age).delay);
    mean += newest(age).delay / static_cast<double>(count);
  }
  const double scale = std::max(kLeastScaleNs, kScaleOfExcess * (mean - least));
  const double origin = newest(0).x;
  double w = 0.0;
  double wx = 0.0;
  double wy = 0.0;
  double wxx = 0.0;
  double wxy = 0.0;
  for (std::size_t age = 0; age < count; ++age) {
    const Point& point = newest(age);
    const double weight = weight_of(point, least, scale);
    const double x = point.x - origin;
    w += weight;
    wx += weight * x;
    wy += weight * point.offset;
    wxx += weight * x * x;
    wxy += weight * x * point.offset;
  }
  const double determinant = w * wxx - wx * wx;
  if (!(determinant > 0.0)) return false;
  slope_ = (w * wxy - wx * wy) / determinant;
  at_newest_ = (wy - slope_ * wx) / w;
  return true;
}

/// Too few changes of sign (5 % of chance): the line is bent, and the oldest points are too old.
bool MinimumDelayServo::residuals_run(std::size_t count) const noexcept {
  std::size_t runs = 1;
  bool above = false;
  for (std::size_t age = 0; age < count; ++age) {
    const Point& point = newest(age);
    const bool up = point.offset > at_newest_ + slope_ * (point.x - newest(0).x);
    if (age > 0 && up != above) ++runs;
    above = up;
  }
  const auto n = static_cast<double>(count);
  return static_cast<double>(runs) < 0.5 * n - 0.82 * std::sqrt(n);
}

void MinimumDelayServo::fit() noexcept {
  if (length_ < kFewestPoints) return;
  for (;;) {
    fitted_ = fit_line(length_) || fitted_;
    if (length_ < kFewestForRuns || !residuals_run(length_)) return;
    length_ -= std::max<std::size_t>(1, length_ / 8);
  }
}

/// free running = reference + at_newest + slope (reference - newest), both since the first message.
ServoUpdate MinimumDelayServo::steer(const ClockReading& now) noexcept {
  const Duration free = now.free_running - first_.free_running;
  const double x0 = newest(0).x;
  const double gap_ns = (free - Duration::from_ns(x0)).ns() - at_newest_;
  const double y = at_newest_ + slope_ * gap_ns / (1.0 + slope_);
  const ReferenceTime reference = first_.reference + free - Duration::from_ns(y);
  const Duration offset = offset_from_reference(now.local, reference);
  const Rate tracking = Rate::from_ratio(1.0 / (1.0 + slope_));
  const Rate pull = Rate::from_ratio(1.0 - offset.ns() / interval_ns_);
  snapshot_.state = ServoState::kLocked;
  snapshot_.offset_known = true;
  snapshot_.offset = offset;
  snapshot_.path_delay = Duration::from_ns(newest(0).delay);
  snapshot_.rate_ratio = tracking;
  return {SampleVerdict::kUsed,
          true,
          {config_.limits.clamp(tracking * pull), Duration::from_ns(interval_ns_),
           config_.limits.clamp(tracking), Duration{}}};
}

/// True when the message completed something to fit.
bool MinimumDelayServo::add(const TimestampPair& pair) noexcept {
  const Stamp stamp = stamp_of(pair);
  const bool forward = pair.direction == Direction::kForward;
  if (config_.fixed_path_delay) {
    if (!forward) return false;
    const auto delay = static_cast<double>(config_.fixed_path_delay->count());
    add_point({stamp.x, stamp.y - delay, delay});
  } else if (forward) {
    forward_ = stamp;
    return false;
  } else if (!forward_) {
    return false;
  } else if (config_.selection == DelaySelection::kWindow) {
    add_to_window(*forward_, stamp);
  } else {
    add_exchange(*forward_, stamp);
  }
  forward_.reset();
  interval_ns_ = config_.sync_interval > Nanoseconds{0}
                     ? static_cast<double>(config_.sync_interval.count())
                     : std::max(stamp.x - last_x_, 1.0);
  last_x_ = stamp.x;
  return true;
}

ServoUpdate MinimumDelayServo::update(const TimestampPair& pair, const ClockReading& now) noexcept {
  if (!started_) first_ = pair;
  started_ = true;
  if (!add(pair)) return {};
  fit();
  return fitted_ ? steer(now) : ServoUpdate{};
}

}  // namespace ftcs
