// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/time/visit.h"

namespace ftcs {
namespace cycle_servo_detail {

/// One bad latch must not throw the phase away; a reference that restarted stays off.
inline constexpr std::uint32_t kOutOfPhaseForResync = 3;

[[nodiscard]] constexpr Nanoseconds interval_of(const CycleServoConfig& config) noexcept {
  return config.cycle * static_cast<std::int64_t>(config.cycles_per_sync);
}
[[nodiscard]] inline FtcsConfig ftcs_config(const CycleServoConfig& config) noexcept {
  FtcsConfig result;
  result.sync_interval = interval_of(config);
  result.offset_gain = config.offset_gain;
  result.converged_band = config.band;
  result.converged_dwell = config.converged_dwell;
  result.limits = config.limits;
  // Between two samples no crystal is off by more than F.
  result.plausible_ratio = config.limits;
  return result;
}
[[nodiscard]] inline PicsConfig pics_config(const CycleServoConfig& config) noexcept {
  PicsConfig result;
  result.sync_interval = interval_of(config);
  result.proportional_gain = config.proportional_gain;
  result.integral_gain = config.integral_gain;
  result.initial_rate = config.initial_rate;
  result.limits = config.limits;
  result.plausible_ratio = config.limits;
  return result;
}
[[nodiscard]] inline AdaptiveConfig adaptive_config(const CycleServoConfig& config) noexcept {
  AdaptiveConfig result;
  result.sync_interval = config.cycle;
  result.fixed_path_delay = Nanoseconds{0};  // transit is taken off before
  result.steering.rate = config.limits;
  return result;
}

/// The greatest multiple of `step` that is not above `value`.
[[nodiscard]] constexpr std::int64_t floor_to(std::int64_t value, std::int64_t step) noexcept {
  const std::int64_t remainder = value % step;
  return value - (remainder < 0 ? remainder + step : remainder);
}

}  // namespace cycle_servo_detail

template <class Adaptive>
BasicCycleServo<Adaptive>::BasicCycleServo(const CycleServoConfig& config) noexcept
    : config_(config),
      history_(SteeringHistory::Map{}),
      timer_({.first = LocalTime{}, .cycle_time = config.cycle, .resolution = config.resolution}),
      lock_(config.lock),
      gate_(config.outliers) {
  // In its place: the adaptive one is too large for a stack.
  using namespace cycle_servo_detail;
  switch (config.law) {
    case CycleLaw::kNone:
      break;
    case CycleLaw::kFtcs:
      law_.template emplace<SampledCycleLaw<FtcsServo, 1>>(ftcs_config(config));
      break;
    case CycleLaw::kPics:
      law_.template emplace<SampledCycleLaw<PicsServo, 2>>(pics_config(config));
      break;
    case CycleLaw::kAdaptive:
      law_.template emplace<MessageCycleLaw<Adaptive>>(adaptive_config(config));
      break;
  }
}

template <class Adaptive>
CycleLawTraits BasicCycleServo<Adaptive>::traits() const noexcept {
  return ftcs::visit([](const auto& law) { return law.kTraits; }, law_);
}

template <class Adaptive>
CycleDecision BasicCycleServo<Adaptive>::start(FreeRunningTime now) noexcept {
  history_ = SteeringHistory({now, LocalTime{}, config_.initial_rate});
  timer_ = CycleTimer({.first = LocalTime{config_.cycle},
                       .cycle_time = config_.cycle,
                       .resolution = config_.resolution});
  anchored_ = false;
  lock_.reset();
  restart_law();
  return decide(now);
}

template <class Adaptive>
void BasicCycleServo<Adaptive>::restart_law() noexcept {
  ftcs::visit([](auto& law) { law.reset(); }, law_);
  commands_ = 0;
  until_sync_ = 0;
  out_of_phase_ = 0;
  gate_.reset();
}

/// In phase by the start's jump alone is no lock: the first interval still drifts away from it.
template <class Adaptive>
bool BasicCycleServo<Adaptive>::rate_known() const noexcept {
  return commands_ >= traits().commands_to_rate;
}

template <class Adaptive>
FreeRunningTime BasicCycleServo<Adaptive>::scheduled_of(const CycleSample& sample) const noexcept {
  return sample.has_scheduled ? sample.scheduled : trigger_.scheduled;
}

template <class Adaptive>
FreeRunningTime BasicCycleServo<Adaptive>::stamp_of(const CycleSample& sample) const noexcept {
  if (config_.trigger == TriggerModel::kKnown) return sample.sent;
  return sample.has_scheduled ? sample.scheduled : trigger_.virtual_instant;
}

template <class Adaptive>
CycleVerdict BasicCycleServo<Adaptive>::judge(const CycleSample& sample) const noexcept {
  if (!sample.has_reference) return CycleVerdict::kLost;
  const Duration late{config_.largest_lateness};
  const Duration slow{config_.largest_round_trip};
  if (late > Duration{} && abs(sample.sent - scheduled_of(sample)) > late)
    return CycleVerdict::kLate;
  if (slow > Duration{} && sample.has_received && sample.received - sample.sent > slow) {
    return CycleVerdict::kSlow;
  }
  return CycleVerdict::kUsed;
}

template <class Adaptive>
void BasicCycleServo<Adaptive>::count(CycleVerdict verdict) noexcept {
  switch (verdict) {
    case CycleVerdict::kUsed:
      ++counters_.used;
      break;
    case CycleVerdict::kLost:
      ++counters_.lost;
      break;
    case CycleVerdict::kLate:
      ++counters_.late;
      break;
    case CycleVerdict::kSlow:
      ++counters_.slow;
      break;
    case CycleVerdict::kImpossible:
      ++counters_.impossible;
      break;
    case CycleVerdict::kDoubtful:
      ++counters_.doubtful;
      break;
  }
}

template <class Adaptive>
CycleDecision BasicCycleServo<Adaptive>::update(const CycleSample& sample,
                                                FreeRunningTime now) noexcept {
  ++counters_.cycles;
  decision_.commanded = false;
  decision_.lateness = sample.sent - scheduled_of(sample);
  decision_.verdict = judge(sample);
  if (decision_.verdict == CycleVerdict::kUsed) {
    coasting_ = 0;
    const FreeRunningTime stamp = stamp_of(sample);
    if (!anchored_) anchor(sample, stamp);
    follow(sample, stamp, now);
  } else if (coasting_ < config_.coast_limit) {
    ++coasting_;
  }
  if (until_sync_ > 0) --until_sync_;
  count(decision_.verdict);
  timer_.advance();
  return decide(now);
}

/// The steered clock is set so that the phase, folded to half a cycle at most, is what it is. With
/// align_at_start it is set to the reference itself: there is no phase left.
template <class Adaptive>
void BasicCycleServo<Adaptive>::anchor(const CycleSample& sample, FreeRunningTime stamp) noexcept {
  const std::int64_t cycle = config_.cycle.count();
  const std::int64_t shift = config_.shift.count();
  const Duration reference = (sample.reference - Duration{config_.transit}).since_epoch();
  // Reference time of the virtual trigger, and the grid instant nearest to it.
  const Duration at_trigger = reference - (stamp - trigger_.virtual_instant);
  const std::int64_t nearest =
      cycle_servo_detail::floor_to(at_trigger.rounded_ns() - shift + cycle / 2, cycle) + shift;
  LocalTime first = LocalTime::from_ns(nearest);
  if (config_.align_at_start) {
    history_ = SteeringHistory({stamp, LocalTime{reference}, config_.initial_rate});
  } else {
    history_ = SteeringHistory({trigger_.virtual_instant, first, config_.initial_rate});
  }
  timer_ =
      CycleTimer({.first = first, .cycle_time = config_.cycle, .resolution = config_.resolution});
  anchored_ = true;
}

template <class Adaptive>
void BasicCycleServo<Adaptive>::follow(const CycleSample& sample, FreeRunningTime stamp,
                                       FreeRunningTime now) noexcept {
  // E: early is positive, as local minus reference is.
  const ReferenceTime reference = sample.reference - Duration{config_.transit};
  const LocalTime local = history_.local_at(stamp);
  const Duration error = offset_from_reference(local, reference);
  const bool off =
      abs(error) > Duration{config_.cycle}.half() + Duration{config_.cycle}.half().half();
  out_of_phase_ = off ? out_of_phase_ + 1 : 0;
  if (off) {
    decision_.verdict = CycleVerdict::kImpossible;
    if (out_of_phase_ < cycle_servo_detail::kOutOfPhaseForResync) return;
    ++counters_.resyncs;
    anchored_ = false;
    lock_.reset();
    restart_law();
    return;
  }
  decision_.phase_error = error;
  const bool doubted = doubtful(error);
  if (doubted) decision_.verdict = CycleVerdict::kDoubtful;
  if (rate_known() && !doubted) lock_.update(error);
  if (doubted && !traits().every_cycle) return;
  const ServoUpdate update = ask_law(sample, stamp, local, now);
  if (update.has_command) apply(update.command, now);
}

/// A decision costs two medians: it is made only where something hangs on this one phase. The
/// paper's servo takes every sample.
template <class Adaptive>
bool BasicCycleServo<Adaptive>::doubtful(Duration error) noexcept {
  if (config_.trigger == TriggerModel::kIdeal) return false;
  if (!sample_due() && abs(error) < config_.lock.band.leave) {
    gate_.observe(error);
    return false;
  }
  return gate_.decide(error) == GateDecision::kReject;
}

/// FTCS and PICS act on this cycle, if it has a good sample.
template <class Adaptive>
bool BasicCycleServo<Adaptive>::sample_due() const noexcept {
  return traits().once_per_sync && until_sync_ == 0;
}

template <class Adaptive>
ServoUpdate BasicCycleServo<Adaptive>::ask_law(const CycleSample& sample, FreeRunningTime stamp,
                                               LocalTime local, FreeRunningTime now) noexcept {
  if (!traits().every_cycle && !sample_due()) return {};
  if (traits().once_per_sync) until_sync_ = config_.cycles_per_sync;
  const CyclePhase phase{sample.reference - Duration{config_.transit}, local, stamp};
  const ClockReading reading{now, history_.local_at(now)};
  return ftcs::visit([&](auto& law) { return law.update(phase, reading); }, law_);
}

template <class Adaptive>
void BasicCycleServo<Adaptive>::apply(const ServoCommand& command, FreeRunningTime now) noexcept {
  const Rate tracking = config_.limits.clamp(command.tracking_rate);
  if (command.correction_time > Duration{}) {
    history_.steer(now, config_.limits.clamp(command.correction_rate));
    history_.steer(now + scale(command.correction_time, tracking.inverse()), tracking);
  } else {
    history_.steer(now, tracking);
  }
  decision_.rate = tracking;
  decision_.commanded = true;
  ++commands_;
}

template <class Adaptive>
CycleDecision BasicCycleServo<Adaptive>::decide(FreeRunningTime now) noexcept {
  const std::int64_t skipped = timer_.skip_missed(history_.local_at(now));
  decision_.skipped = static_cast<std::uint64_t>(skipped);
  counters_.skipped += decision_.skipped;
  trigger_ = timer_.next(history_);
  decision_.wake = trigger_.scheduled;
  decision_.virtual_instant = trigger_.virtual_instant;
  if (!anchored_) {
    decision_.state = CycleState::kWaiting;
  } else if (lock_.locked()) {
    decision_.state =
        coasting_ >= config_.coast_limit ? CycleState::kCoasting : CycleState::kLocked;
  } else {
    decision_.state = CycleState::kAcquiring;
  }
  return decision_;
}

}  // namespace ftcs
