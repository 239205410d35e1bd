// SPDX-License-Identifier: MIT
#include "ftcs/servo/baseline/regression_servo.h"

#include "ftcs/servo/sample_progress.h"

namespace ftcs {
namespace {

/// The first errors count equally, then the mean forgets: window choice must follow a change within
/// 50 samples.
constexpr unsigned kPlainMeanErrors = 10;
constexpr double kForgetting = 0.02;
/// A longer window is preferred unless it predicts this much worse.
constexpr double kTolerance = 1.05;

}  // namespace

std::optional<ServoConfigError> validate(const RegressionConfig& config) noexcept {
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  return std::nullopt;
}

void RegressionServo::add(const SyncSample& sample) noexcept {
  if (count_ == 0) first_ = sample;
  const Duration free = sample.free_running - first_.free_running;
  const Duration reference = sample.reference() - first_.reference();
  points_[count_ % kPoints] = {free.ns(), (reference - free).ns()};
  ++count_;
}

void RegressionServo::judge_predictions() noexcept {
  if (count_ < 2) return;
  const Point& now = newest(0);
  const Point& before = newest(1);
  for (Window& window : windows_) {
    if (!window.fitted) continue;
    const double miss = now.y - (window.at_newest + window.slope * (now.x - before.x));
    ++window.errors;
    const double weight = window.errors <= kPlainMeanErrors ? 1.0 / window.errors : kForgetting;
    window.error += weight * (miss * miss - window.error);
  }
}

void RegressionServo::fit(std::size_t index) noexcept {
  const std::size_t size = kSizes[index];
  if (count_ < size) return;
  const Point& last = newest(0);
  double mean_x = 0.0;
  double mean_y = 0.0;
  for (std::size_t age = 0; age < size; ++age) {
    mean_x += newest(age).x - last.x;
    mean_y += newest(age).y - last.y;
  }
  mean_x /= static_cast<double>(size);
  mean_y /= static_cast<double>(size);
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t age = 0; age < size; ++age) {
    const double x = newest(age).x - last.x - mean_x;
    xx += x * x;
    xy += x * (newest(age).y - last.y - mean_y);
  }
  Window& window = windows_[index];
  window.fitted = true;
  window.slope = xy / xx;
  window.at_newest = last.y + mean_y - window.slope * mean_x;
}

std::size_t RegressionServo::choose() const noexcept {
  double best = -1.0;
  for (const Window& window : windows_) {
    if (window.errors > 0 && (best < 0.0 || window.error < best)) best = window.error;
  }
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < kWindows; ++i) {
    if (windows_[i].errors > 0 && windows_[i].error <= kTolerance * best) chosen = i;
  }
  return chosen;
}

ServoUpdate RegressionServo::update(const SyncSample& sample, const ClockReading& now) noexcept {
  if (count_ > 0) {
    const SampleProgress progress = progress_between(previous_, sample, RateLimits{});
    if (progress.verdict == SampleVerdict::kDuplicate) return {progress.verdict, false, {}};
    if (progress.verdict == SampleVerdict::kImplausible) {
      reset();  // the line has ended
      return {progress.verdict, false, {}};
    }
    interval_ = progress.reference;
  }
  if (config_.sync_interval > Nanoseconds{0}) interval_ = config_.sync_interval;
  previous_ = sample;
  add(sample);
  judge_predictions();
  for (std::size_t i = 0; i < kWindows; ++i) fit(i);
  snapshot_.offset = sample.offset();
  snapshot_.path_delay = sample.path_delay;
  if (count_ < kSizes[0]) return {};

  const std::size_t chosen = choose();
  const Window& window = windows_[chosen];
  const Rate tracking = Rate::from_ratio(1.0 + window.slope);
  // Reference now, read from the line: first + free running + y.
  const Duration free = now.free_running - first_.free_running;
  const double y = window.at_newest + window.slope * (free.ns() - newest(0).x);
  const ReferenceTime reference = first_.reference() + free + Duration::from_ns(y);
  const double offset_ns = offset_from_reference(now.local, reference).ns();
  const double intervals = kSizes[chosen] <= 16 ? 1.0 : (kSizes[chosen] == 32 ? 2.0 : 3.0);
  const double correction_ns = intervals * interval_.ns();
  snapshot_.state = ServoState::kLocked;
  snapshot_.rate_ratio = tracking;
  const Rate pull = Rate::from_ratio(1.0 - offset_ns / correction_ns);
  return {SampleVerdict::kUsed,
          true,
          {config_.limits.clamp(tracking * pull), Duration::from_ns(correction_ns),
           config_.limits.clamp(tracking), Duration{}}};
}

}  // namespace ftcs
