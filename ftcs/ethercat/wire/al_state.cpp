// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/wire/al_state.h"

#include <algorithm>
#include <array>

namespace ftcs::ethercat {

namespace {
struct NamedCode {
  AlStatusCode code;
  const char* name;
};

using enum AlStatusCode;
constexpr std::array kNames{
    NamedCode{kNoError, "no error"},
    NamedCode{kUnspecifiedError, "unspecified error"},
    NamedCode{kNoMemory, "no memory"},
    NamedCode{kInvalidRequestedStateChange, "invalid requested state change"},
    NamedCode{kUnknownRequestedState, "unknown requested state"},
    NamedCode{kBootstrapNotSupported, "bootstrap not supported"},
    NamedCode{kNoValidFirmware, "no valid firmware"},
    NamedCode{kInvalidMailboxConfigurationBoot, "invalid mailbox configuration (bootstrap)"},
    NamedCode{kInvalidMailboxConfiguration, "invalid mailbox configuration"},
    NamedCode{kInvalidSyncManagerConfiguration, "invalid sync manager configuration"},
    NamedCode{kNoValidInputs, "no valid inputs available"},
    NamedCode{kNoValidOutputs, "no valid outputs"},
    NamedCode{kSynchronizationError, "synchronization error"},
    NamedCode{kSyncManagerWatchdog, "sync manager watchdog"},
    NamedCode{kInvalidSyncManagerTypes, "invalid sync manager types"},
    NamedCode{kInvalidOutputConfiguration, "invalid output configuration"},
    NamedCode{kInvalidInputConfiguration, "invalid input configuration"},
    NamedCode{kInvalidWatchdogConfiguration, "invalid watchdog configuration"},
    NamedCode{kNeedsColdStart, "needs cold start"},
    NamedCode{kNeedsInit, "needs INIT"},
    NamedCode{kNeedsPreOp, "needs PREOP"},
    NamedCode{kNeedsSafeOp, "needs SAFEOP"},
    NamedCode{kInvalidInputMapping, "invalid input mapping"},
    NamedCode{kInvalidOutputMapping, "invalid output mapping"},
    NamedCode{kInconsistentSettings, "inconsistent settings"},
    NamedCode{kFreeRunNotSupported, "free run not supported"},
    NamedCode{kSyncModeNotSupported, "synchronization mode not supported"},
    NamedCode{kBackgroundWatchdog, "background watchdog"},
    NamedCode{kNoValidInputsAndOutputs, "no valid inputs and outputs"},
    NamedCode{kFatalSyncError, "fatal SYNC error"},
    NamedCode{kNoSyncError, "no SYNC error"},
    NamedCode{kInvalidDcSyncConfiguration, "invalid DC SYNC configuration"},
    NamedCode{kInvalidDcLatchConfiguration, "invalid DC latch configuration"},
    NamedCode{kPllError, "PLL error"},
    NamedCode{kDcSyncIoError, "DC SYNC I/O error"},
    NamedCode{kDcSyncTimeout, "DC SYNC timeout"},
    NamedCode{kInvalidSyncCycleTime, "invalid SYNC cycle time"},
    NamedCode{kInvalidSync0CycleTime, "invalid SYNC0 cycle time"},
    NamedCode{kInvalidSync1CycleTime, "invalid SYNC1 cycle time"},
};
constexpr std::uint16_t kVendorSpecific = 0x8000;
}  // namespace

const char* name(AlState state) noexcept {
  switch (state) {
    case AlState::kInit:
      return "INIT";
    case AlState::kPreOp:
      return "PREOP";
    case AlState::kBootstrap:
      return "BOOT";
    case AlState::kSafeOp:
      return "SAFEOP";
    case AlState::kOp:
      return "OP";
    case AlState::kNone:
      break;
  }
  return "NONE";
}

const char* name(AlStatusCode code) noexcept {
  const auto found = std::find_if(kNames.begin(), kNames.end(),
                                  [code](const NamedCode& named) { return named.code == code; });
  if (found != kNames.end()) return found->name;
  return static_cast<std::uint16_t>(code) >= kVendorSpecific ? "vendor specific" : "unknown code";
}

}  // namespace ftcs::ethercat
