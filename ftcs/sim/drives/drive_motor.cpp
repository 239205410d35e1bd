// SPDX-License-Identifier: MIT
#include "ftcs/sim/drives/drive_motor.h"

#include <cmath>

namespace ftcs::ethercat {

namespace {
/// Half of the position error per sample: a stiff loop without overshoot.
constexpr double kLoopGain = 0.5;
constexpr std::int8_t kCyclicSynchronousPosition = 8;

constexpr std::uint16_t kFaultReset = 0x80;
constexpr std::uint16_t kRemote = 0x0200;
constexpr std::uint16_t kFollowsCommand = 0x1000;
constexpr std::uint16_t kVoltageEnabled = 0x0010;

bool disable_voltage(unsigned word) noexcept { return (word & 0x02U) == 0; }
bool quick_stop(unsigned word) noexcept { return (word & 0x06U) == 0x02; }
bool shutdown(unsigned word) noexcept { return (word & 0x07U) == 0x06; }
bool switch_on(unsigned word) noexcept { return (word & 0x07U) == 0x07; }
bool enable_operation(unsigned word) noexcept { return (word & 0x0FU) == 0x0F; }
}  // namespace

double DriveMotor::steady_gain(double radians) noexcept {
  constexpr double kRest = 1.0 - kLoopGain;
  return kLoopGain / std::sqrt(1.0 - 2.0 * kRest * std::cos(radians) + kRest * kRest);
}

void DriveMotor::control(std::uint16_t controlword, bool operational) noexcept {
  using enum DriveState;
  const bool reset_edge = (controlword & kFaultReset) != 0 && (controlword_ & kFaultReset) == 0;
  controlword_ = controlword;
  if (state_ == kFault) {
    if (reset_edge) {
      state_ = kSwitchOnDisabled;
      error_code_ = 0;
    }
    return;
  }
  if (!operational || disable_voltage(controlword)) {
    state_ = kSwitchOnDisabled;
    return;
  }
  if (quick_stop(controlword)) {
    state_ = state_ == kOperationEnabled || state_ == kQuickStopActive ? kQuickStopActive
                                                                       : kSwitchOnDisabled;
    return;
  }
  // One transition per controlword, as a drive does it.
  switch (state_) {
    case kSwitchOnDisabled:
      if (shutdown(controlword)) state_ = kReadyToSwitchOn;
      break;
    case kReadyToSwitchOn:
      if (switch_on(controlword)) state_ = kSwitchedOn;
      break;
    case kSwitchedOn:
      if (enable_operation(controlword)) state_ = kOperationEnabled;
      if (shutdown(controlword)) state_ = kReadyToSwitchOn;
      break;
    case kOperationEnabled:
      if (shutdown(controlword)) state_ = kReadyToSwitchOn;
      if (switch_on(controlword) && !enable_operation(controlword)) state_ = kSwitchedOn;
      break;
    case kQuickStopActive:
      if (enable_operation(controlword)) state_ = kOperationEnabled;
      break;
    case kFault:
      break;
  }
}

void DriveMotor::fault(std::uint16_t error_code) noexcept {
  state_ = DriveState::kFault;
  error_code_ = error_code;
}

void DriveMotor::sample(std::int32_t target, std::int8_t mode) noexcept {
  following_ = state_ == DriveState::kOperationEnabled && mode == kCyclicSynchronousPosition;
  const std::int32_t before = position();
  if (following_) position_ += kLoopGain * (static_cast<double>(target) - position_);
  velocity_ = position() - before;
  following_error_ = following_ ? target - position() : 0;
}

std::uint16_t DriveMotor::statusword() const noexcept {
  const auto word = [this]() -> unsigned {
    switch (state_) {
      case DriveState::kSwitchOnDisabled:
        return 0x0040;
      case DriveState::kReadyToSwitchOn:
        return 0x0021 | kVoltageEnabled;
      case DriveState::kSwitchedOn:
        return 0x0023 | kVoltageEnabled;
      case DriveState::kOperationEnabled:
        return 0x0027 | kVoltageEnabled | (following_ ? kFollowsCommand : 0U);
      case DriveState::kQuickStopActive:
        return 0x0007 | kVoltageEnabled;
      case DriveState::kFault:
        break;
    }
    return 0x0008;
  }();
  return static_cast<std::uint16_t>(word | kRemote);
}

}  // namespace ftcs::ethercat
