// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/ethercat/wire/al_state.h"
#include "ftcs/ethercat/wire/mailbox.h"
#include "ftcs/ethercat/wire/sii.h"

namespace ftcs::ethercat {

/// Why a bring-up or a run has ended; fields of Failure that belong to a kind are named with it.
enum class FailureKind : std::uint8_t {
  kNone,
  kNoReply,              ///< frames go out and none comes back
  kNoSubDevices,         ///< frames come back untouched
  kTooManySubDevices,    ///< more than the capacity of this MainDevice
  kFewerThanConfigured,  ///< expected, received
  kNotAnswering,         ///< a SubDevice that was counted does not answer to its address
  kImpossibleTopology,   ///< the ports that are open do not form a tree of what was counted
  kBadSii,               ///< sii tells what is wrong
  kSiiTimeout,
  kInOperation,  ///< somebody is in OP before the scan: another MainDevice drives them
  kInUse,        ///< registers change before anything was written: another MainDevice is at work
  kMailboxUnusable,  ///< size of a mailbox: too small for an SDO or too large for a frame
  kBringUpTimeout,   ///< every answer came in time, and there was no end of them
  kFrameTooLarge,    ///< what is to be sent does not fit into one frame
  kNotStopped,       ///< asked for SAFEOP again and again, somebody is still in OP
  kStateRefused,     ///< wanted, actual and code tell which transition and why
  kStateTimeout,
  kSdoAborted,  ///< object and abort
  kSdoTimeout,
  kSdoMalformed,          ///< mailbox tells what is wrong
  kProcessImageTooLarge,  ///< more than one frame holds
  kNoDistributedClock,    ///< nobody can be the reference
  kNarrowClock,           ///< plant time asked for; the reference's system time has 32 bits
  kNoBridge,              ///< plant time of a bridge terminal asked for; there is none
  kBridgeSilent,          ///< its other side is not connected, or its stamps stand still
  kReplaced,              ///< what was restarted is not what was scanned: known, found
  kClockNotSteady,        ///< a restarted SubDevice's clock does not follow the reference
  kWorkingCounter,        ///< too many cycles in a row; expected, received
  kSyncLost,              ///< the cycle does not follow the reference any more
  kNeverLocked,           ///< the cycle did not find the reference's phase in time
  kNeverOperational,      ///< asked for OP, not all SubDevices came to it in time
  kLinkLost,              ///< too many lost frames in a row
};
[[nodiscard]] const char* name(FailureKind kind) noexcept;

/// What went wrong and whose fault it is. Fields that do not belong to the kind are at rest.
struct Failure {
  static constexpr std::uint16_t kNobody = 0xFFFF;
  FailureKind kind = FailureKind::kNone;
  std::uint16_t position = kNobody;  ///< of the SubDevice on the wire
  std::uint16_t expected = 0;
  std::uint16_t received = 0;
  AlState wanted = AlState::kNone;
  AlState actual = AlState::kNone;
  AlStatusCode code = AlStatusCode::kNoError;
  ObjectAddress object{};
  SdoAbort abort = SdoAbort::kNone;
  SiiError sii = SiiError::kTooShort;
  Identity known{};
  Identity found{};
  MailboxError mailbox = MailboxError::kTooShort;

  [[nodiscard]] constexpr explicit operator bool() const noexcept {
    return kind != FailureKind::kNone;
  }
};

}  // namespace ftcs::ethercat
