// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/failure.h"

namespace ftcs::ethercat {

namespace {
/// Of a cycle that ran.
const char* name_in_operation(FailureKind kind) noexcept {
  switch (kind) {
    case FailureKind::kNotStopped:
      return "SubDevices did not leave OP when they were stopped";
    case FailureKind::kReplaced:
      return "another SubDevice in the place of the one that was scanned";
    case FailureKind::kClockNotSteady:
      return "clock does not follow the reference";
    case FailureKind::kWorkingCounter:
      return "working counter wrong";
    case FailureKind::kSyncLost:
      return "cycle out of sync with the reference";
    case FailureKind::kNeverLocked:
      return "cycle never in phase with the reference";
    case FailureKind::kNeverOperational:
      return "SubDevices did not come to OP in time";
    case FailureKind::kLinkLost:
      return "frames lost";
    default:
      return "unknown failure";
  }
}
}  // namespace

const char* name(FailureKind kind) noexcept {
  switch (kind) {
    case FailureKind::kNone:
      return "no failure";
    case FailureKind::kNoReply:
      return "no reply";
    case FailureKind::kNoSubDevices:
      return "no SubDevices";
    case FailureKind::kTooManySubDevices:
      return "too many SubDevices";
    case FailureKind::kFewerThanConfigured:
      return "fewer SubDevices than configured";
    case FailureKind::kNotAnswering:
      return "SubDevice does not answer";
    case FailureKind::kImpossibleTopology:
      return "impossible topology";
    case FailureKind::kBadSii:
      return "bad SII";
    case FailureKind::kSiiTimeout:
      return "SII stays busy";
    case FailureKind::kInOperation:
      return "SubDevices are in OP already: another MainDevice drives them";
    case FailureKind::kInUse:
      return "somebody else configures the SubDevices: another MainDevice is at work";
    case FailureKind::kMailboxUnusable:
      return "mailbox of unusable size";
    case FailureKind::kBringUpTimeout:
      return "bring-up does not come to an end";
    case FailureKind::kFrameTooLarge:
      return "request larger than one frame";
    case FailureKind::kStateRefused:
      return "state refused";
    case FailureKind::kStateTimeout:
      return "state not reached in time";
    case FailureKind::kSdoAborted:
      return "SDO aborted";
    case FailureKind::kSdoTimeout:
      return "SDO not answered";
    case FailureKind::kSdoMalformed:
      return "SDO answer malformed";
    case FailureKind::kProcessImageTooLarge:
      return "process data larger than one frame";
    case FailureKind::kNoDistributedClock:
      return "no SubDevice with a distributed clock";
    case FailureKind::kNarrowClock:
      return "the reference clock has 32 bits only: plant time needs 64";
    case FailureKind::kNoBridge:
      return "no bridge terminal with CoE and a clock of 64 bits that could tell plant time";
    case FailureKind::kBridgeSilent:
      return "the bridge terminal tells no time: its other side is not connected, or not running";
    default:
      return name_in_operation(kind);
  }
}

}  // namespace ftcs::ethercat
