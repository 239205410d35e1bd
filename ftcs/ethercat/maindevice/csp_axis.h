// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/ethercat/maindevice/csp_profile.h"

namespace ftcs::ethercat {

/// CiA 402's states (6.3) as far as they matter to who moves the axis: on the way to "operation
/// enabled", there, in "fault" or its reaction, or not asked for.
enum class AxisState : std::uint8_t { kDisabled, kEnabling, kEnabled, kFault };
[[nodiscard]] const char* name(AxisState state) noexcept;

/// One drive in cyclic synchronous position: walks the state machine of CiA 402 and keeps the
/// target on the actual position until the drive is enabled, so that enabling never jumps.
///
///     controlword: 0x06 shutdown -> 0x07 switch on -> 0x0F enable operation, each upon the
///     statusword that permits it; 0x00 disable voltage where not asked for; 0x80 fault reset
///
///     target = origin + displacement    modulo 2^32 counts, once enabled
class CspAxis {
 public:
  /// What is asked of the axis in this cycle.
  struct Command {
    bool enable = false;
    bool reset_fault = false;
    /// Displacement from where the axis stood when it was enabled, counts.
    std::int32_t displacement = 0;
  };
  /// One cycle: what to send, given what came.
  [[nodiscard]] csp::Outputs cycle(const csp::Inputs& inputs, const Command& command) noexcept;

  [[nodiscard]] AxisState state() const noexcept { return state_; }
  /// Where the axis stood when it was last about to be enabled, counts.
  [[nodiscard]] std::int32_t origin() const noexcept { return origin_; }
  /// The drive was restarted: nothing is known of it.
  void restart() noexcept { *this = CspAxis{}; }

 private:
  AxisState state_ = AxisState::kDisabled;
  std::int32_t origin_ = 0;
  bool reset_sent_ = false;
};

}  // namespace ftcs::ethercat
