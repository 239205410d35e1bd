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
/// that a cycle out of phase brings about are 0x001A, 0x0032 to 0x0034 and, where frames stay away
/// altogether, 0x001B.
enum class AlStatusCode : std::uint16_t {
  kNoError = 0x0000,
  kUnspecifiedError = 0x0001,
  kNoMemory = 0x0002,
  kInvalidRequestedStateChange = 0x0011,  ///< no such step, as INIT to OP
  kUnknownRequestedState = 0x0012,
  kBootstrapNotSupported = 0x0013,
  kNoValidFirmware = 0x0014,
  kInvalidMailboxConfigurationBoot = 0x0015,
  kInvalidMailboxConfiguration = 0x0016,      ///< sync managers 0 and 1, on the way to PREOP
  kInvalidSyncManagerConfiguration = 0x0017,  ///< 2 and 3, on the way to SAFEOP
  kNoValidInputs = 0x0018,
  kNoValidOutputs = 0x0019,        ///< none came before OP was asked for
  kSynchronizationError = 0x001A,  ///< process data and SYNC0 do not fit together
  kSyncManagerWatchdog = 0x001B,   ///< no process data for the time of the watchdog, in OP
  kInvalidSyncManagerTypes = 0x001C,
  kInvalidOutputConfiguration = 0x001D,    ///< the length of sync manager 2 is not the mapping's
  kInvalidInputConfiguration = 0x001E,     ///< of sync manager 3
  kInvalidWatchdogConfiguration = 0x001F,  ///< 0x0400 to 0x0420
  kNeedsColdStart = 0x0020,                ///< switch it off and on
  kNeedsInit = 0x0021,
  kNeedsPreOp = 0x0022,
  kNeedsSafeOp = 0x0023,
  kInvalidInputMapping = 0x0024,   ///< objects that 0x1A00 cannot hold
  kInvalidOutputMapping = 0x0025,  ///< objects that 0x1600 cannot hold
  kInconsistentSettings = 0x0026,
  kFreeRunNotSupported = 0x0027,   ///< 0x1C32:01, 0x1C33:01
  kSyncModeNotSupported = 0x0028,  ///< the same
  kBackgroundWatchdog = 0x002A,
  kNoValidInputsAndOutputs = 0x002B,
  kFatalSyncError = 0x002C,              ///< SYNC0 or SYNC1 does not come any more
  kNoSyncError = 0x002D,                 ///< it did not come at all, in SAFEOP
  kInvalidDcSyncConfiguration = 0x0030,  ///< 0x0980 and what follows
  kInvalidDcLatchConfiguration = 0x0031,
  kPllError = 0x0032,       ///< its own PLL has not settled on the MainDevice's cycle
  kDcSyncIoError = 0x0033,  ///< it had, and is not any more
  kDcSyncTimeout = 0x0034,  ///< too many process data missed at SYNC0
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
