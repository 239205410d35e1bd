// SPDX-License-Identifier: MIT
#include "ftcs/servo/external_servo.h"

#include <cmath>

namespace ftcs {
namespace {

ftcs_servo_time time_of(Duration since_epoch) noexcept {
  const std::int64_t whole_ns = since_epoch.floor_ns();
  return {whole_ns, (since_epoch - Duration::from_whole_ns(whole_ns)).ns()};
}

bool is_sound(const ftcs_servo_command& command) noexcept {
  return std::isfinite(command.correction_rate_ppb) && std::isfinite(command.correction_time_ns) &&
         std::isfinite(command.tracking_rate_ppb) && std::isfinite(command.step_ns) &&
         command.correction_time_ns >= 0.0;
}

}  // namespace

ftcs_servo_observation ExternalServo::observe(const TimestampPair& pair,
                                              const ClockReading& now) noexcept {
  const bool forward = pair.direction == Direction::kForward;
  if (!config_.fixed_path_delay) {
    if (forward) {
      delay_.on_forward(pair.reference, pair.free_running);
    } else {
      (void)delay_.on_backward(pair.free_running, pair.reference);
    }
  }
  ftcs_servo_observation seen{};
  seen.direction = forward ? FTCS_SERVO_FORWARD : FTCS_SERVO_BACKWARD;
  seen.reference = time_of(pair.reference.since_epoch());
  seen.local = time_of(pair.local.since_epoch());
  seen.free_running = time_of(pair.free_running.since_epoch());
  seen.now_local = time_of(now.local.since_epoch());
  seen.now_free_running = time_of(now.free_running.since_epoch());
  seen.path_delay_ns = path_delay_known() ? path_delay().ns() : ServoSnapshot::kUnknown;
  seen.offset_ns = ServoSnapshot::kUnknown;
  if (forward && path_delay_known()) {
    snapshot_.offset = offset_from_reference(pair.local, pair.reference + path_delay());
    snapshot_.offset_known = true;
    seen.offset_ns = snapshot_.offset.ns();
  }
  return seen;
}

ServoUpdate ExternalServo::obey(const ftcs_servo_command& command) noexcept {
  if (!is_sound(command)) {
    if (config_.tally != nullptr) ++config_.tally->unsound;
    return {SampleVerdict::kImplausible, false, {}};
  }
  if (config_.tally != nullptr) ++config_.tally->commands;
  snapshot_.state = ServoState::kLocked;
  ServoUpdate update{SampleVerdict::kUsed, true, {}};
  update.command.correction_rate = Rate::from_ppb(command.correction_rate_ppb);
  update.command.correction_time = Duration::from_ns(command.correction_time_ns);
  update.command.tracking_rate = Rate::from_ppb(command.tracking_rate_ppb);
  update.command.step = Duration::from_ns(command.step_ns);
  snapshot_.rate_ratio = update.command.tracking_rate;
  return update;
}

ServoUpdate ExternalServo::update(const TimestampPair& pair, const ClockReading& now) noexcept {
  const ftcs_servo_observation seen = observe(pair, now);
  ftcs_servo_command command{};
  if (config_.tally != nullptr) ++config_.tally->messages;
  switch (config_.functions->update(config_.instance, &seen, &command)) {
    case FTCS_SERVO_COMMAND:
      return obey(command);
    case FTCS_SERVO_REJECTED:
      return {SampleVerdict::kRejected, false, {}};
    default:
      return {};
  }
}

void ExternalServo::reset() noexcept {
  delay_.reset();
  snapshot_ = {};
  config_.functions->reset(config_.instance);
}

ServoSnapshot ExternalServo::snapshot() const noexcept {
  ServoSnapshot snapshot = snapshot_;
  snapshot.path_delay = path_delay();
  if (config_.functions->believe == nullptr) return snapshot;
  ftcs_servo_belief belief{ServoSnapshot::kUnknown, ServoSnapshot::kUnknown,
                           ServoSnapshot::kUnknown};
  config_.functions->believe(config_.instance, &belief);
  if (std::isfinite(belief.offset_ns)) snapshot.offset = Duration::from_ns(belief.offset_ns);
  if (std::isfinite(belief.rate_ppb)) snapshot.rate_ratio = Rate::from_ppb(belief.rate_ppb);
  snapshot.offset_sigma_ns = belief.offset_sigma_ns;
  return snapshot;
}

}  // namespace ftcs
