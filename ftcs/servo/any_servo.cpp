// SPDX-License-Identifier: MIT
#include "ftcs/servo/any_servo.h"

#include "ftcs/time/visit.h"

namespace ftcs {
namespace {

/// The law's own configuration with the common settings filled in.
template <class LawConfig>
LawConfig with_common(LawConfig law, const ServoConfig& common) noexcept {
  if (common.sync_interval != Nanoseconds{0}) law.sync_interval = common.sync_interval;
  law.limits = intersect(law.limits, common.limits);
  return law;
}

AdaptiveConfig with_common(AdaptiveConfig servo, const ServoConfig& common) noexcept {
  if (common.sync_interval != Nanoseconds{0}) servo.sync_interval = common.sync_interval;
  if (!servo.fixed_path_delay.has_value()) {
    servo.fixed_path_delay = common.two_way.fixed_path_delay;
  }
  servo.steering.rate = intersect(servo.steering.rate, common.limits);
  return servo;
}

std::optional<ServoConfigError> validate(const ExternalConfig& servo) noexcept {
  if (servo.functions == nullptr || servo.instance == nullptr) return ServoConfigError::kExternal;
  if (!servo.fixed_path_delay && !servo.path_delay.valid()) return ServoConfigError::kPathDelay;
  return std::nullopt;
}

/// Of servos that hear both directions themselves and may be told the delay instead.
template <class PairServoConfig>
PairServoConfig with_delay(PairServoConfig servo, const ServoConfig& common) noexcept {
  if (!servo.fixed_path_delay.has_value()) {
    servo.fixed_path_delay = common.two_way.fixed_path_delay;
  }
  return with_common(servo, common);
}

ExternalConfig with_common(ExternalConfig servo, const ServoConfig& common) noexcept {
  servo.path_delay = common.two_way.path_delay;
  servo.fixed_path_delay = common.two_way.fixed_path_delay;
  return servo;
}

}  // namespace

std::string_view servo_kind_name(ServoKind kind) noexcept {
  for (const ServoKindName& entry : kServoKinds) {
    if (entry.kind == kind) return entry.name;
  }
  return "unknown";
}

std::optional<ServoKind> servo_kind_from_name(std::string_view name) noexcept {
  for (const ServoKindName& entry : kServoKinds) {
    if (entry.name == name) return entry.kind;
  }
  return std::nullopt;
}

std::optional<ServoConfigError> validate(const ServoConfig& config) noexcept {
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  const auto classic = [&config](const auto& law) {
    const auto wrong = validate(law);
    return wrong ? wrong : validate(config.two_way);
  };
  switch (config.kind) {
    case ServoKind::kFtcs:
      return classic(with_common(config.ftcs, config));
    case ServoKind::kPics:
      return classic(with_common(config.pics, config));
    case ServoKind::kLinuxptpPi:
      return classic(with_common(config.linuxptp_pi, config));
    case ServoKind::kFreeRunning:
      return classic(config.free_running);
    case ServoKind::kAdaptive:
      return validate(with_common(config.adaptive, config));
    case ServoKind::kRegression:
      return classic(with_common(config.regression, config));
    case ServoKind::kPid:
      return classic(with_common(config.pid, config));
    case ServoKind::kFrequencyCompensated:
      return classic(with_common(config.frequency_compensated, config));
    case ServoKind::kKalman:
      return validate(with_delay(config.kalman, config));
    case ServoKind::kMinimumDelay:
      return validate(with_delay(config.minimum_delay, config));
    case ServoKind::kExternal:
      return validate(with_common(config.external, config));
  }
  return std::nullopt;
}

AnyServo make_servo(const ServoConfig& config) noexcept {
  const TwoWayConfig& two_way = config.two_way;
  switch (config.kind) {
    case ServoKind::kFtcs:
      return AnyServo{std::in_place_type<TwoWayServo<FtcsServo>>, two_way,
                      with_common(config.ftcs, config)};
    case ServoKind::kPics:
      return AnyServo{std::in_place_type<TwoWayServo<PicsServo>>, two_way,
                      with_common(config.pics, config)};
    case ServoKind::kLinuxptpPi:
      return AnyServo{std::in_place_type<TwoWayServo<LinuxptpPiServo>>, two_way,
                      with_common(config.linuxptp_pi, config)};
    case ServoKind::kAdaptive:
      return AnyServo{std::in_place_type<AdaptiveServo>, with_common(config.adaptive, config)};
    case ServoKind::kRegression:
      return AnyServo{std::in_place_type<TwoWayServo<RegressionServo>>, two_way,
                      with_common(config.regression, config)};
    case ServoKind::kPid:
      return AnyServo{std::in_place_type<TwoWayServo<PidServo>>, two_way,
                      with_common(config.pid, config)};
    case ServoKind::kFrequencyCompensated:
      return AnyServo{std::in_place_type<TwoWayServo<FrequencyCompensatedServo>>, two_way,
                      with_common(config.frequency_compensated, config)};
    case ServoKind::kKalman:
      return AnyServo{std::in_place_type<KalmanServo>, with_delay(config.kalman, config)};
    case ServoKind::kMinimumDelay:
      return AnyServo{std::in_place_type<MinimumDelayServo>,
                      with_delay(config.minimum_delay, config)};
    case ServoKind::kExternal:
      return AnyServo{std::in_place_type<ExternalServo>, with_common(config.external, config)};
    case ServoKind::kFreeRunning:
      break;
  }
  return AnyServo{std::in_place_type<TwoWayServo<FreeRunningServo>>, two_way, config.free_running};
}

ServoUpdate AnyServo::update(const TimestampPair& pair, const ClockReading& now) noexcept {
  return ftcs::visit([&](auto& servo) noexcept { return servo.update(pair, now); }, servo_);
}

void AnyServo::reset() noexcept {
  ftcs::visit([](auto& servo) noexcept { servo.reset(); }, servo_);
}

void AnyServo::on_step(Duration step) noexcept {
  ftcs::visit(
      [step](auto& servo) noexcept {
        if constexpr (requires { servo.on_step(step); }) servo.on_step(step);
      },
      servo_);
}

void AnyServo::on_new_epoch() noexcept {
  ftcs::visit(
      [](auto& servo) noexcept {
        if constexpr (requires { servo.on_new_epoch(); }) {
          servo.on_new_epoch();
        } else {
          servo.reset();
        }
      },
      servo_);
}

bool AnyServo::path_delay_known() const noexcept {
  return ftcs::visit(
      [](const auto& servo) noexcept {
        if constexpr (requires { servo.path_delay_known(); }) return servo.path_delay_known();
        return true;
      },
      servo_);
}

void AnyServo::free_path_delay(double sigma_ns) noexcept {
  ftcs::visit(
      [sigma_ns](auto& servo) noexcept {
        if constexpr (requires { servo.free_path_delay(sigma_ns); }) {
          servo.free_path_delay(sigma_ns);
        }
      },
      servo_);
}

ServoSnapshot AnyServo::snapshot() const noexcept {
  return ftcs::visit([](const auto& servo) noexcept { return servo.snapshot(); }, servo_);
}

ServoSnapshot AnyServo::snapshot_at(const ClockReading& now) const noexcept {
  return ftcs::visit(
      [&now](const auto& servo) noexcept {
        if constexpr (requires { servo.snapshot_at(now); }) return servo.snapshot_at(now);
        return servo.snapshot();
      },
      servo_);
}

}  // namespace ftcs
