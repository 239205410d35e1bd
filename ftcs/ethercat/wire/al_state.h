// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace ftcs::ethercat {

/// States of the application layer (ETG.1000.6, 6.4.1), as AL control and AL status hold them.
enum class AlState : std::uint8_t {
  kNone = 0,       ///< not known, or out of reach
  kInit = 1,       ///< no mailbox, no process data
  kPreOp = 2,      ///< mailbox: objects can be read and written
  kBootstrap = 3,  ///< firmware download
  kSafeOp = 4,     ///< inputs are valid, outputs are held in a safe state
  kOp = 8,         ///< outputs act
};
inline constexpr std::uint16_t kAlStateMask = 0x0F;
/// In AL status: the SubDevice refused or left a state. In AL control: acknowledge it.
inline constexpr std::uint16_t kAlErrorFlag = 0x10;

/// AL status codes (ETG.1000.6, 5.3.2; ETG.1020): why a SubDevice refused or left a state. Those
/// that a cycle out of phase brings about are 0x001A and 0x002C (SYNC0 and frames do not fit
/// together), 0x001B (no outputs for a while), 0x0032 and 0x0034 (its own PLL, or no SYNC0).
enum class AlStatusCode : std::uint16_t {
  kNoError = 0x0000,
  kUnspecifiedError = 0x0001,
  kNoMemory = 0x0002,
  kInvalidRequestedStateChange = 0x0011,
  kUnknownRequestedState = 0x0012,
  kBootstrapNotSupported = 0x0013,
  kNoValidFirmware = 0x0014,
  kInvalidMailboxConfigurationBoot = 0x0015,
  kInvalidMailboxConfiguration = 0x0016,
  kInvalidSyncManagerConfiguration = 0x0017,
  kNoValidInputs = 0x0018,
  kNoValidOutputs = 0x0019,
  kSynchronizationError = 0x001A,
  kSyncManagerWatchdog = 0x001B,
  kInvalidSyncManagerTypes = 0x001C,
  kInvalidOutputConfiguration = 0x001D,
  kInvalidInputConfiguration = 0x001E,
  kInvalidWatchdogConfiguration = 0x001F,
  kNeedsColdStart = 0x0020,
  kNeedsInit = 0x0021,
  kNeedsPreOp = 0x0022,
  kNeedsSafeOp = 0x0023,
  kInvalidInputMapping = 0x0024,
  kInvalidOutputMapping = 0x0025,
  kInconsistentSettings = 0x0026,
  kFreeRunNotSupported = 0x0027,
  kSyncModeNotSupported = 0x0028,
  kBackgroundWatchdog = 0x002A,
  kNoValidInputsAndOutputs = 0x002B,
  kFatalSyncError = 0x002C,
  kNoSyncError = 0x002D,
  kInvalidDcSyncConfiguration = 0x0030,
  kInvalidDcLatchConfiguration = 0x0031,
  kPllError = 0x0032,
  kDcSyncIoError = 0x0033,
  kDcSyncTimeout = 0x0034,
  kInvalidSyncCycleTime = 0x0035,
  kInvalidSync0CycleTime = 0x0036,
  kInvalidSync1CycleTime = 0x0037,
};

[[nodiscard]] const char* name(AlState state) noexcept;
/// What the standard calls the code; "vendor specific" above 0x8000.
[[nodiscard]] const char* name(AlStatusCode code) noexcept;

/// Legal requests (ETG.1000.6, 6.4.2): one step up, any way down, or stay. Bootstrap apart.
[[nodiscard]] constexpr bool is_legal_transition(AlState from, AlState to) noexcept {
  const auto rank = [](AlState state) {
    switch (state) {
      case AlState::kInit:
        return 1;
      case AlState::kPreOp:
        return 2;
      case AlState::kSafeOp:
        return 3;
      case AlState::kOp:
        return 4;
      default:
        return 0;
    }
  };
  return rank(from) > 0 && rank(to) > 0 && rank(to) <= rank(from) + 1;
}

}  // namespace ftcs::ethercat
