// SPDX-License-Identifier: MIT
#include "ftcs/servo/ftcs_servo.h"

namespace ftcs {

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
  state_.previous = sample;
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
  const ServoCommand command = steer(sample, now, progress);
  state_.previous = sample;
  return {SampleVerdict::kUsed, true, command};
}

void FtcsServo::reset() noexcept {
  state_ = State{};
  snapshot_.state = ServoState::kUnlocked;
}

namespace {

/// The correction ends T_c after the *sample* (Fig. 3: local and reference meet at tau_rd(n) +
/// T_c), however late the command comes. A command that is later than half of T_c would need more
/// than twice the rate: it takes its half of T_c all the same.
Duration remaining_time(Duration correction_time, Duration latency) noexcept {
  const Duration remaining = correction_time - latency;
  const Duration shortest = correction_time.half();
  return remaining < shortest ? shortest : remaining;
}

}  // namespace

double FtcsServo::gain_for(Duration offset) noexcept {
  const bool first_action = state_.phase != Phase::kActing;
  if (first_action && config_.converged_dwell > 0) return 1.0;
  const bool converged =
      state_.converged.update(offset, config_.converged_band, config_.converged_dwell);
  return converged ? config_.offset_gain : 1.0;
}

ServoCommand FtcsServo::steer(const SyncSample& sample, const ClockReading& now,
                              const SampleProgress& progress) noexcept {
  const Rate tracking = progress.ratio();
  const Duration latency = scale(now.free_running - sample.free_running, tracking);
  const ReferenceTime reference_now = sample.reference() + latency;
  const Duration offset = offset_from_reference(now.local, reference_now);
  const double gain = gain_for(offset);

  const Duration sync_interval =
      config_.sync_interval > Nanoseconds{0} ? Duration{config_.sync_interval} : progress.reference;
  const Duration wanted_time =
      config_.correction_time > Nanoseconds{0} ? Duration{config_.correction_time} : sync_interval;
  const Duration correction_time = remaining_time(wanted_time, latency);
  // (1 + p T_offset / T_c) k a with T_offset = -offset   (17), (19)
  const Rate pull = Rate::from_ratio(1.0 - gain * offset.ns() / correction_time.ns());
  snapshot_.rate_ratio = tracking;
  snapshot_.offset_gain = gain;
  ServoCommand command;
  const Rate wanted = pull * tracking;
  command.correction_rate = config_.limits.clamp(wanted);
  // As long as F cuts eq. 18 short, the offset it was to remove is still there: the first action
  // goes on.
  if (command.correction_rate == wanted) state_.phase = Phase::kActing;
  command.correction_time = correction_time;
  command.tracking_rate = config_.limits.clamp(tracking);
  return command;
}

}  // namespace ftcs
