// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "ftcs/clock/command_check.h"
#include "ftcs/discipline/basic_clock_discipline.h"
#include "ftcs/discipline/late_expiry.h"

namespace ftcs {

template <ClockServo Servo>
std::optional<ClockError> BasicClockDiscipline<Servo>::start_at(Rate rate) noexcept {
  begin(clock_.read());
  ServoCommand command;
  command.tracking_rate = rate;
  command = within_limits(command);
  const Result<ClockReading, ClockError> applied = clock_.apply(command);
  if (!applied) return applied.error();
  rate_change_.note(command, applied->free_running);
  return std::nullopt;
}

template <ClockServo Servo>
Telemetry BasicClockDiscipline<Servo>::on_pair(const EventPair& event, bool paces) noexcept {
  const ClockReading now = clock_.read();
  begin(now);
  const TimestampPair pair{event.direction, event.reference, clock_.local_at(event.free_running),
                           event.free_running};
  const ServoUpdate update = update_in_order(order_, servo_, pair, now);
  telemetry_.direction = event.direction;
  telemetry_.verdict = update.verdict;
  const bool used = update.verdict == SampleVerdict::kUsed;
  answered_ = answered_ || (used && event.direction == Direction::kBackward);
  path_delay_measured_ = answered_ && servo_knows_path_delay();
  telemetry_.servo = known(servo_.snapshot());
  if (used && !paces) {
    ++counters_.beside;
  } else {
    count(event.direction, update.verdict);
  }
  if (paces && event.direction == Direction::kForward) {
    if (used || lock_survives(pair)) note_sample(event);
    // Offsets seen before the servo steers are the oscillator's own: small ones are luck, no lock.
    const bool steers = !traits_.steers || telemetry_.servo.state != ServoState::kUnlocked;
    if (used && steers && telemetry_.servo.offset_known) lock_.update(telemetry_.servo.offset);
  }
  check_silence(now);
  if (update.has_command) steer(update.command, telemetry_.servo.offset);
  return finish();
}

template <ClockServo Servo>
Telemetry BasicClockDiscipline<Servo>::on_silence() noexcept {
  const ClockReading now = clock_.read();
  begin(now);
  if constexpr (requires { servo_.snapshot_at(now); }) {
    if (telemetry_.servo.offset_known) telemetry_.servo = known(servo_.snapshot_at(now));
  }
  check_silence(now);
  return finish();
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::on_new_reference() noexcept {
  order_.reset();
  servo_.reset();
  lock_.reset();
  awaits_sample_ = has_sample_ || awaits_sample_;
  has_sample_ = false;
  samples_ = 0;
  waiting_since_ = clock_.read().free_running;
  sync_interval_.forget_gap();
  announced_interval_ = Duration{};
  in_holdover_ = false;
  answered_ = path_delay_measured_ = false;
  ++counters_.new_references;
  telemetry_.servo = known(servo_.snapshot());
  finish();
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::on_new_timescale() noexcept {
  first_command_ = true;
  on_new_reference();
}

template <ClockServo Servo>
JumpPlan BasicClockDiscipline<Servo>::on_reference_jump(Duration jump) noexcept {
  const Nanoseconds largest = config_.largest_offset;
  const bool is_beginning = largest > Nanoseconds{0} && abs(jump) > Duration{largest};
  if (is_beginning) {
    on_new_timescale();
  } else {
    on_new_reference();
  }
  const bool may_step = config_.step.permits(first_command_);
  if (may_step && abs(jump) > Duration{config_.step.threshold}) return {JumpResponse::kStepped, {}};
  if (is_beginning) return {JumpResponse::kRefused, {}};
  return {JumpResponse::kSlewed, slew_time(jump)};
}

template <ClockServo Servo>
Duration BasicClockDiscipline<Servo>::slew_time(Duration jump) const noexcept {
  const RateLimits limits = intersect(limits_, traits_.slewing);
  const double limit = (jump < Duration{} ? limits.slowest : limits.fastest).ratio();
  double speed = std::abs(limit / telemetry_.tracking_rate.ratio() - 1.0);
  if (config_.largest_rate_change > 0.0) speed = std::min(speed, config_.largest_rate_change);
  return Duration::from_ns(std::abs(jump.ns()) / speed);
}

// What a path delay that nobody knows leaves of the offset is no small deviation.
template <ClockServo Servo>
ServoSnapshot BasicClockDiscipline<Servo>::known(ServoSnapshot snapshot) const noexcept {
  if (path_delay_known()) return snapshot;
  snapshot.offset_sigma_ns = ServoSnapshot::kUnknown;
  snapshot.path_delay_sigma_ns = ServoSnapshot::kUnknown;
  return snapshot;
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::begin(const ClockReading& reading) noexcept {
  telemetry_.reading = reading;
  telemetry_.commanded = false;
  telemetry_.step = Duration{};
  telemetry_.offset_refused = false;
  telemetry_.error.reset();
  if (!first_command_) telemetry_.applied_rate = rate_change_.in_force(reading.free_running);
}

template <ClockServo Servo>
const Telemetry& BasicClockDiscipline<Servo>::finish() noexcept {
  telemetry_.locked = locked();
  if (in_holdover_) telemetry_.servo.state = ServoState::kHoldover;
  return telemetry_;
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::count(Direction direction, SampleVerdict verdict) noexcept {
  switch (verdict) {
    case SampleVerdict::kUsed:
      ++(direction == Direction::kForward ? counters_.used : counters_.backward);
      break;
    case SampleVerdict::kRejected:
      ++counters_.rejected;
      break;
    case SampleVerdict::kDuplicate:
      ++counters_.duplicate;
      break;
    case SampleVerdict::kImplausible:
      ++counters_.implausible;
      break;
  }
}

// It may be an outlier or the truth: either way the transmitter is alive, and the clock no further
// off than a lock allows. Only a servo that knows its deviation can say so.
template <ClockServo Servo>
bool BasicClockDiscipline<Servo>::lock_survives(const TimestampPair& refused) const noexcept {
  const ServoSnapshot& servo = telemetry_.servo;
  if (telemetry_.verdict != SampleVerdict::kRejected || !servo.offset_known) return false;
  const Duration said = offset_from_reference(refused.local, refused.reference + servo.path_delay);
  return std::abs(said.ns()) < config_.lock.band.leave.ns() &&
         servo.offset_sigma_ns < config_.lock.band.enter.ns();
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::note_sample(const EventPair& pair) noexcept {
  if (has_sample_ && traits_.sync_interval == Nanoseconds{0}) {
    sync_interval_.add(pair.reference - last_sample_.reference);
  }
  last_sample_ = pair;
  has_sample_ = true;
  if (samples_ < std::numeric_limits<std::uint32_t>::max()) ++samples_;
  awaits_sample_ = false;
  in_holdover_ = false;
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::check_silence(const ClockReading& reading) noexcept {
  const bool configured = traits_.sync_interval > Nanoseconds{0};
  const Duration interval = configured ? Duration{traits_.sync_interval}
                                       : std::max(sync_interval_.value(), announced_interval_);
  if (!(has_sample_ || awaits_sample_) || in_holdover_ || interval <= Duration{}) return;
  const FreeRunningTime since = has_sample_ ? last_sample_.free_running : waiting_since_;
  const Duration silence = reading.free_running - since;
  if (!is_outage(silence, interval, config_.missed_intervals_to_holdover)) return;
  in_holdover_ = true;
  ++counters_.holdovers;
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::steer(const ServoCommand& wanted, Duration offset) noexcept {
  if (refuses(offset)) {
    telemetry_.offset_refused = true;
    ++counters_.refused;
    return;
  }
  const ServoCommand command = within_limits(with_step(wanted, offset));
  const Result<ClockReading, ClockError> applied = clock_.apply(command);
  if (!applied) {
    telemetry_.error = applied.error();
    ++counters_.apply_errors;
    return;
  }
  rate_change_.note(command, applied->free_running);
  first_command_ = false;
  ++counters_.commands;
  if (at_limit(command)) ++counters_.clamps;
  if (command.step != Duration{}) {
    ++counters_.steps;
    if constexpr (requires { servo_.on_step(command.step); }) {
      if (wanted.step == Duration{}) servo_.on_step(command.step);
    }
  }
  telemetry_.commanded = true;
  telemetry_.step = command.step;
  telemetry_.applied_rate = command.correction_rate;
  telemetry_.tracking_rate = command.tracking_rate;
}

template <ClockServo Servo>
bool BasicClockDiscipline<Servo>::refuses(Duration offset) const noexcept {
  return config_.largest_offset > Nanoseconds{0} && !config_.step.permits(first_command_) &&
         abs(offset) > Duration{config_.largest_offset};
}

template <ClockServo Servo>
ServoCommand BasicClockDiscipline<Servo>::with_step(ServoCommand command,
                                                    Duration offset) const noexcept {
  if (!config_.step.permits(first_command_)) {
    command.step = Duration{};
    return command;
  }
  if (traits_.decides_steps || abs(offset) <= Duration{config_.step.threshold}) return command;
  return {command.tracking_rate, Duration{}, command.tracking_rate, -offset};
}

template <ClockServo Servo>
ServoCommand BasicClockDiscipline<Servo>::within_limits(ServoCommand command) noexcept {
  if (!is_finite(command)) return command;  // no limit makes it one: the clock refuses it
  command = stretched(command, clock_.expiry_lateness());
  rate_change_.begin(clock_, telemetry_.reading.free_running);
  command = rate_change_.limited(command, telemetry_.reading.free_running);
  command.tracking_rate = limits_.clamp(command.tracking_rate);
  command.correction_rate = limits_.clamp(command.correction_rate);
  return command;
}

template <ClockServo Servo>
bool BasicClockDiscipline<Servo>::at_limit(const ServoCommand& command) const noexcept {
  const auto at_edge = [this](Rate rate) {
    return rate == limits_.slowest || rate == limits_.fastest;
  };
  return at_edge(command.correction_rate) || at_edge(command.tracking_rate);
}

// An answer may be kept for the next Sync, or tell an impossible delay there.
template <ClockServo Servo>
bool BasicClockDiscipline<Servo>::servo_knows_path_delay() const noexcept {
  if constexpr (requires { servo_.path_delay_known(); }) return servo_.path_delay_known();
  return true;
}

template <ClockServo Servo>
void BasicClockDiscipline<Servo>::free_path_delay(double sigma_ns) noexcept {
  if constexpr (requires { servo_.free_path_delay(sigma_ns); }) servo_.free_path_delay(sigma_ns);
}

}  // namespace ftcs
