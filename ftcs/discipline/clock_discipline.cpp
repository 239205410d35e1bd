// SPDX-License-Identifier: MIT
#include "ftcs/discipline/clock_discipline.h"

#include <algorithm>
#include <cmath>

namespace ftcs {
namespace {

/// A command of the adaptive servo keeps both of its rates this near to the last tracking rate, and
/// rounds them: with half of what may change, the end of a correction keeps to the limit too.
double planned_rate_change(const SteeringLimits& steering, double largest) noexcept {
  const double room = largest - steering.rate_granularity;
  const double planned = (room > 0.0 ? room : largest) / 2.0;
  return steering.rate_change > 0.0 ? std::min(steering.rate_change, planned) : planned;
}

ServoConfig limited(const DisciplineConfig& config, const RateLimits& limits) noexcept {
  ServoConfig servo = config.servo;
  servo.limits = limits;
  if (config.largest_rate_change > 0.0) {
    SteeringLimits& steering = servo.adaptive.steering;
    steering.rate_change = planned_rate_change(steering, config.largest_rate_change);
  }
  return servo;
}

bool has_fixed_delay(const ServoConfig& servo) noexcept {
  return servo.two_way.fixed_path_delay ||
         (servo.kind == ServoKind::kAdaptive && servo.adaptive.fixed_path_delay) ||
         (servo.kind == ServoKind::kKalman && servo.kalman.fixed_path_delay);
}

}  // namespace

ClockDiscipline::ClockDiscipline(const DisciplineConfig& config, AdjustableClock& clock) noexcept
    : config_(config),
      clock_(clock),
      limits_(intersect(config.servo.limits, clock.rate_limits())),
      servo_(make_servo(limited(config, limits_))),
      lock_(config.lock),
      rate_change_(config.largest_rate_change),
      path_delay_is_fixed_(has_fixed_delay(config.servo)),
      sync_interval_(config.servo.sync_interval) {}

std::optional<ClockError> ClockDiscipline::start_at(Rate rate) noexcept {
  begin(clock_.read());
  ServoCommand command;
  command.tracking_rate = rate;
  command = within_limits(command);
  const Result<ClockReading, ClockError> applied = clock_.apply(command);
  if (!applied) return applied.error();
  rate_change_.note(command, applied->free_running);
  return std::nullopt;
}

Telemetry ClockDiscipline::on_pair(const EventPair& event, bool paces) noexcept {
  const ClockReading now = clock_.read();
  begin(now);
  const TimestampPair pair{event.direction, event.reference, clock_.local_at(event.free_running),
                           event.free_running};
  const ServoUpdate update = servo_.update(pair, now);
  telemetry_.direction = event.direction;
  telemetry_.verdict = update.verdict;
  const bool used = update.verdict == SampleVerdict::kUsed;
  if (used && event.direction == Direction::kBackward) path_delay_measured_ = true;
  telemetry_.servo = known(servo_.snapshot());
  if (used && !paces) {
    ++counters_.beside;
  } else {
    count(event.direction, update.verdict);
  }
  if (paces && event.direction == Direction::kForward) {
    if (used || lock_survives(pair)) note_sample(event);
    if (used && telemetry_.servo.offset_known) lock_.update(telemetry_.servo.offset);
  }
  check_silence(now);
  if (update.has_command) steer(update.command, telemetry_.servo.offset);
  return finish();
}

Telemetry ClockDiscipline::on_silence() noexcept {
  const ClockReading now = clock_.read();
  begin(now);
  if (telemetry_.servo.offset_known) telemetry_.servo = known(servo_.snapshot_at(now));
  check_silence(now);
  // What is silence is decided here: the servo knows only the gaps that it saw.
  if (!in_holdover_ && telemetry_.servo.state == ServoState::kHoldover) {
    telemetry_.servo.state = servo_.snapshot().state;
  }
  return finish();
}

void ClockDiscipline::on_new_reference() noexcept {
  servo_.reset();
  lock_.reset();
  awaits_sample_ = has_sample_ || awaits_sample_;
  has_sample_ = false;
  waiting_since_ = clock_.read().free_running;
  last_gap_ = Duration{};
  announced_interval_ = Duration{};
  in_holdover_ = false;
  path_delay_measured_ = false;
  ++counters_.new_references;
  telemetry_.servo = known(servo_.snapshot());
  finish();
}

void ClockDiscipline::on_new_timescale() noexcept {
  first_command_ = true;
  on_new_reference();
}

JumpPlan ClockDiscipline::on_reference_jump(Duration jump) noexcept {
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

Duration ClockDiscipline::slew_time(Duration jump) const noexcept {
  const bool plans = config_.servo.kind == ServoKind::kAdaptive;
  const RateLimits limits =
      plans ? intersect(limits_, config_.servo.adaptive.steering.rate) : limits_;
  const double limit = (jump < Duration{} ? limits.slowest : limits.fastest).ratio();
  double speed = std::abs(limit / telemetry_.tracking_rate.ratio() - 1.0);
  if (config_.largest_rate_change > 0.0) speed = std::min(speed, config_.largest_rate_change);
  return Duration::from_ns(std::abs(jump.ns()) / speed);
}

// What a path delay that nobody knows leaves of the offset is no small deviation.
ServoSnapshot ClockDiscipline::known(ServoSnapshot snapshot) const noexcept {
  if (path_delay_known()) return snapshot;
  snapshot.offset_sigma_ns = ServoSnapshot::kUnknown;
  snapshot.path_delay_sigma_ns = ServoSnapshot::kUnknown;
  return snapshot;
}

void ClockDiscipline::begin(const ClockReading& reading) noexcept {
  telemetry_.reading = reading;
  telemetry_.commanded = false;
  telemetry_.step = Duration{};
  telemetry_.offset_refused = false;
  telemetry_.error.reset();
}

const Telemetry& ClockDiscipline::finish() noexcept {
  telemetry_.locked = locked();
  if (in_holdover_) telemetry_.servo.state = ServoState::kHoldover;
  return telemetry_;
}

void ClockDiscipline::count(Direction direction, SampleVerdict verdict) noexcept {
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
bool ClockDiscipline::lock_survives(const TimestampPair& refused) const noexcept {
  const ServoSnapshot& servo = telemetry_.servo;
  if (telemetry_.verdict != SampleVerdict::kRejected || !servo.offset_known) return false;
  const Duration said = offset_from_reference(refused.local, refused.reference + servo.path_delay);
  return std::abs(said.ns()) < config_.lock.band.leave.ns() &&
         servo.offset_sigma_ns < config_.lock.band.enter.ns();
}

void ClockDiscipline::note_sample(const EventPair& pair) noexcept {
  if (has_sample_ && config_.servo.sync_interval == Nanoseconds{0}) {
    const Duration gap = pair.reference - last_sample_.reference;
    sync_interval_ = last_gap_ > Duration{} ? std::min(gap, last_gap_) : gap;
    last_gap_ = gap;
  }
  last_sample_ = pair;
  has_sample_ = true;
  awaits_sample_ = false;
  in_holdover_ = false;
}

void ClockDiscipline::check_silence(const ClockReading& reading) noexcept {
  const bool configured = config_.servo.sync_interval > Nanoseconds{0};
  const Duration interval =
      configured ? sync_interval_ : std::max(sync_interval_, announced_interval_);
  if (!(has_sample_ || awaits_sample_) || in_holdover_ || interval <= Duration{}) return;
  const FreeRunningTime since = has_sample_ ? last_sample_.free_running : waiting_since_;
  const double silence_ns = (reading.free_running - since).ns();
  if (silence_ns <= interval.ns() * config_.missed_intervals_to_holdover) return;
  in_holdover_ = true;
  ++counters_.holdovers;
}

void ClockDiscipline::steer(const ServoCommand& wanted, Duration offset) noexcept {
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
    if (wanted.step == Duration{}) servo_.on_step(command.step);
  }
  telemetry_.commanded = true;
  telemetry_.step = command.step;
  telemetry_.applied_rate = command.correction_rate;
  telemetry_.tracking_rate = command.tracking_rate;
}

bool ClockDiscipline::refuses(Duration offset) const noexcept {
  return config_.largest_offset > Nanoseconds{0} && !config_.step.permits(first_command_) &&
         abs(offset) > Duration{config_.largest_offset};
}

ServoCommand ClockDiscipline::with_step(ServoCommand command, Duration offset) const noexcept {
  if (!config_.step.permits(first_command_)) {
    command.step = Duration{};
    return command;
  }
  // linuxptp-pi has thresholds of its own, and its start-up depends on them.
  const bool servo_decides = config_.servo.kind == ServoKind::kLinuxptpPi;
  if (servo_decides || abs(offset) <= Duration{config_.step.threshold}) return command;
  return {command.tracking_rate, Duration{}, command.tracking_rate, -offset};
}

ServoCommand ClockDiscipline::within_limits(ServoCommand command) noexcept {
  rate_change_.begin(clock_, telemetry_.reading.free_running);
  command = rate_change_.limited(command, telemetry_.reading.free_running);
  command.tracking_rate = limits_.clamp(command.tracking_rate);
  command.correction_rate = limits_.clamp(command.correction_rate);
  return command;
}

bool ClockDiscipline::at_limit(const ServoCommand& command) const noexcept {
  const auto at_edge = [this](Rate rate) {
    return rate == limits_.slowest || rate == limits_.fastest;
  };
  return at_edge(command.correction_rate) || at_edge(command.tracking_rate);
}

}  // namespace ftcs
