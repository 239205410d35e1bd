// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/csp_axis.h"

namespace ftcs::ethercat {

namespace {
// Controlwords and masked statuswords (CiA 402, tables of 6.3).
constexpr std::uint16_t kDisableVoltage = 0x00;
constexpr std::uint16_t kShutdown = 0x06;
constexpr std::uint16_t kSwitchOn = 0x07;
constexpr std::uint16_t kEnableOperation = 0x0F;
constexpr std::uint16_t kFaultReset = 0x80;

constexpr unsigned kFaultMask = 0x004F;
constexpr unsigned kFault = 0x0008;
constexpr unsigned kFaultReaction = 0x000F;
constexpr unsigned kStateMask = 0x006F;
constexpr unsigned kReadyToSwitchOn = 0x0021;
constexpr unsigned kSwitchedOn = 0x0023;
constexpr unsigned kOperationEnabled = 0x0027;
}  // namespace

const char* name(AxisState state) noexcept {
  switch (state) {
    case AxisState::kDisabled:
      return "disabled";
    case AxisState::kEnabling:
      return "enabling";
    case AxisState::kEnabled:
      return "enabled";
    case AxisState::kFault:
      return "fault";
  }
  return "unknown";
}

csp::Outputs CspAxis::cycle(const csp::Inputs& inputs, const Command& command) noexcept {
  const unsigned status = inputs.statusword;
  csp::Outputs outputs{.controlword = kDisableVoltage, .target = inputs.position};
  if ((status & kFaultMask) == kFault || (status & kFaultMask) == kFaultReaction) {
    state_ = AxisState::kFault;
    // The reset is an edge: bit 7 must fall before it can rise again.
    reset_sent_ = command.reset_fault && !reset_sent_;
    outputs.controlword = reset_sent_ ? kFaultReset : kDisableVoltage;
    return outputs;
  }
  reset_sent_ = false;
  if (!command.enable) {
    state_ = AxisState::kDisabled;
    return outputs;
  }
  if ((status & kStateMask) != kOperationEnabled) {
    state_ = AxisState::kEnabling;
    origin_ = inputs.position;
    outputs.controlword = kShutdown;
    if ((status & kStateMask) == kReadyToSwitchOn) outputs.controlword = kSwitchOn;
    if ((status & kStateMask) == kSwitchedOn) outputs.controlword = kEnableOperation;
    return outputs;
  }
  state_ = AxisState::kEnabled;
  outputs.controlword = kEnableOperation;
  // Positions wrap modulo 2^32 counts.
  outputs.target = static_cast<std::int32_t>(static_cast<std::uint32_t>(origin_) +
                                             static_cast<std::uint32_t>(command.displacement));
  return outputs;
}

}  // namespace ftcs::ethercat
