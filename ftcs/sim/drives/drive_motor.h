// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace ftcs::ethercat {

/// States of a drive (CiA 402 / IEC 61800-7-201, 6.3).
enum class DriveState : std::uint8_t {
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFault,
};

/// The device side of the CiA 402 state machine and a servo motor behind it, in encoder counts.
///
/// Cyclic synchronous position: at each sample instant (SYNC0) the drive takes the target and its
/// position loop closes a fixed share of the error:  x(n+1) = x(n) + kLoopGain (target(n) - x(n)).
class DriveMotor {
 public:
  /// |H| of the position loop at so many radians per sample: the radius of a circle that it draws,
  /// over the one it is told.  H(z) = g / (z - 1 + g).
  [[nodiscard]] static double steady_gain(double radians) noexcept;
  void reset() noexcept { *this = DriveMotor{}; }
  /// A new controlword; transitions happen only while `operational` (outputs are valid).
  void control(std::uint16_t controlword, bool operational) noexcept;
  void fault(std::uint16_t error_code) noexcept;
  /// One sample instant. Mode 8 follows the target, everything else stands still.
  void sample(std::int32_t target, std::int8_t mode) noexcept;

  [[nodiscard]] std::uint16_t statusword() const noexcept;
  [[nodiscard]] DriveState state() const noexcept { return state_; }
  [[nodiscard]] std::int32_t position() const noexcept {
    return static_cast<std::int32_t>(position_ < 0 ? position_ - 0.5 : position_ + 0.5);
  }
  [[nodiscard]] std::int32_t velocity_per_sample() const noexcept { return velocity_; }
  [[nodiscard]] std::int32_t following_error() const noexcept { return following_error_; }
  [[nodiscard]] std::uint16_t error_code() const noexcept { return error_code_; }
  void place(std::int32_t position) noexcept { position_ = position; }

 private:
  DriveState state_ = DriveState::kSwitchOnDisabled;
  double position_ = 0.0;
  std::int32_t velocity_ = 0;
  std::int32_t following_error_ = 0;
  std::uint16_t controlword_ = 0;
  std::uint16_t error_code_ = 0;
  bool following_ = false;
};

}  // namespace ftcs::ethercat
