// SPDX-License-Identifier: MIT
#include "ftcs/servo/ftcs_servo.h"

#include <algorithm>

namespace ftcs {
namespace {

/// The correction ends T_c after the *sample* (Fig. 3: local and reference meet at tau_rd(n) +
/// T_c), however late the command comes. A command that is later than half of T_c would need more
/// than twice the rate: it takes its half of T_c all the same.
Duration remaining_time(Duration correction_time, Duration latency) noexcept {
  return std::max(correction_time - latency, correction_time.half());
}

}  // namespace

std::optional<ServoConfigError> validate(const FtcsConfig& config) noexcept {
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  const bool interval_known = config.sync_interval > Nanoseconds{0};
  if (config.correction_time < Nanoseconds{0} ||
      (interval_known && config.correction_time > config.sync_interval)) {
    return ServoConfigError::kCorrectionTime;
  }
  // Written so that a gain which is not a number fails too.
  if (!(config.offset_gain >= 0.0 && config.offset_gain <= 1.0)) {
    return ServoConfigError::kOffsetGain;
  }
  if (!config.converged_band.valid()) return ServoConfigError::kConvergedBand;
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  if (!config.plausible_ratio.valid()) return ServoConfigError::kPlausibleRatio;
  return std::nullopt;
}

void FtcsServo::prime(const SyncSample& sample) noexcept {
  if (state_.phase != Phase::kEmpty) return;
  state_.previous = instant_of(sample);
  state_.phase = Phase::kPrimed;
  snapshot_.offset = sample.offset();
  snapshot_.path_delay = sample.path_delay;
}

ServoUpdate FtcsServo::update(const SyncSample& sample, const ClockReading& now) noexcept {
  if (state_.phase == Phase::kEmpty) {
    prime(sample);
    return {};
  }
  const SampleProgress progress =
      progress_between(state_.previous, sample, config_.plausible_ratio);
  if (progress.verdict == SampleVerdict::kDuplicate) {
    return {SampleVerdict::kDuplicate, false, {}};
  }
  if (progress.verdict == SampleVerdict::kImplausible) {
    // Which of the two samples is wrong cannot be known: start again from the newer one.
    reset();
    prime(sample);
    return {SampleVerdict::kImplausible, false, {}};
  }
  snapshot_.state = ServoState::kLocked;
  snapshot_.offset = sample.offset();
  snapshot_.path_delay = sample.path_delay;
  state_.previous = instant_of(sample);
  state_.interval.add(progress.reference);
  // What the clock gathered in an outage is an offset to be removed as at the start, not a trickle
  // for p.
  if (is_outage(progress.reference, sync_interval())) {
    state_.phase = Phase::kPrimed;
    state_.converged = ConvergenceLatch{};
  }
  return steer(sample, now, progress);
}

Duration FtcsServo::sync_interval() const noexcept {
  if (config_.sync_interval > Nanoseconds{0}) return config_.sync_interval;
  return state_.interval.value();
}

void FtcsServo::reset() noexcept {
  state_ = State{};
  snapshot_.state = ServoState::kUnlocked;
}

double FtcsServo::gain_for(double offset_ns) noexcept {
  const bool first_action = state_.phase != Phase::kActing;
  if (first_action && config_.converged_dwell > 0) return 1.0;
  const bool converged =
      state_.converged.update(offset_ns, config_.converged_band, config_.converged_dwell);
  return converged ? config_.offset_gain : 1.0;
}

ServoUpdate FtcsServo::steer(const SyncSample& sample, const ClockReading& now,
                             const SampleProgress& progress) noexcept {
  const Rate tracking = progress.ratio();
  // Since the sample the clock went on by local_elapsed and the reference by waited * tracking. The
  // large parts are subtracted as integers; only the oscillator's deviation is multiplied as a
  // double.
  const Duration waited = now.free_running - sample.free_running;
  const Duration local_elapsed = now.local - sample.local;
  const double extra_ns = waited.ns() * tracking.deviation();
  const double offset_ns = (snapshot_.offset + (local_elapsed - waited)).ns() - extra_ns;
  const double gain = gain_for(offset_ns);

  const Duration wanted_time = config_.correction_time > Nanoseconds{0}
                                   ? Duration{config_.correction_time}
                                   : sync_interval();
  const Duration correction_time =
      remaining_time(wanted_time, waited + Duration::from_ns(extra_ns));
  // (1 + p T_offset / T_c) k a with T_offset = -offset   (17), (19)
  const Rate wanted = Rate::from_ratio(1.0 - gain * offset_ns / correction_time.ns()) * tracking;
  const Rate correction = config_.limits.clamp(wanted);
  // As long as F cuts eq. 18 short, the offset it was to remove is still there: the first action
  // goes on.
  if (correction.ratio() == wanted.ratio()) state_.phase = Phase::kActing;
  snapshot_.rate_ratio = tracking;
  snapshot_.offset_gain = gain;
  return {SampleVerdict::kUsed,
          true,
          {correction, correction_time, config_.limits.clamp(tracking), Duration{}}};
}

}  // namespace ftcs
