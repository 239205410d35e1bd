// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace ftcs::diagnosis {

/// What stands between a clock and its lock. Names are stable (name()): status, metrics and tests
/// refer to them.
enum class Cause : std::uint8_t {
  kLocked,
  kAcquiring,  ///< all is there, the servo is on its way
  // Of a PTP port: nothing to follow.
  kLinkDown,
  kNoAddress,     ///< the interface has no IP address to send from
  kVlan,          ///< PTP is heard in a VLAN alone
  kTransport,     ///< over another transport alone
  kGroup,         ///< L2: to another group address
  kNotDelivered,  ///< on the wire, but not at our socket: a firewall, rp_filter
  kUnicast,       ///< to our own address, which is not listened to
  kMulticast,     ///< to the group, while only a unicast peer is listened to
  kVersion,       ///< IEEE 1588-2002
  kSdo,           ///< another majorSdoId (transportSpecific)
  kDomain,
  kNotAcceptable,  ///< not in the list of acceptable transmitters
  kNotAuthentic,   ///< no authentication, or by other keys
  kUnusableAnnounce,
  kAlternate,  ///< alternateMasterFlag
  kMalformed,
  kSyncWithoutAnnounce,
  kOnlyReceivers,  ///< others who ask, nobody who answers
  kNoAnnounce,     ///< nothing at all
  // The neighbour of a port that measures peer to peer.
  kNoPeer,  ///< answers no Pdelay_Req
  kSeveralPeers,
  kPeerDelayLimit,  ///< beyond neighborPropDelayThresh
  // A transmitter announces, and something is missing.
  kNoSync,
  kNoFollowUp,
  kNoReceiveStamps,
  kNoTransmitStamps,
  kOtherMechanism,  ///< it measures peer to peer, this port end to end
  kNoDelayResp,
  kDelayRespForOthers,
  kTwoTransmitters,       ///< of one identity, or in turn
  kTransmittersDisagree,  ///< two show different times: one is wrong, or a path is asymmetric
  // Time that is not believed, and clocks that do not obey.
  kTimescale,  ///< refused by the epoch's rules: see the reason
  kFirstOffset,
  kOtherSteers,
  kSamplesRefused,
  // Of a cycle on EtherCAT.
  kNoSubDevice,
  kTooFewSubDevices,
  kNoDistributedClock,
  kWorkingCounter,
  kLostFrames,
  kHostLate,
  kMarginTooSmall,
  kDrivesNotOperational,
  kAxisFault,  ///< CiA 402: statusword in the state Fault
  kOther,      ///< a failure with a text of its own
};
inline constexpr std::size_t kCauses = static_cast<std::size_t>(Cause::kOther) + 1;

/// "no_announce": the enumerator's words.
[[nodiscard]] std::string_view name(Cause cause) noexcept;

/// One answer to "why is it not locked?". Each part is a clause without a full stop; what is empty
/// is left out.
struct Finding {
  Cause cause = Cause::kOther;
  std::string seen;       ///< what was observed
  std::string expected;   ///< what should have been
  std::string remedy;     ///< the flag or setting that mends it
  bool in_doubt = false;  ///< the clock follows, but what it follows is not to be relied on
};

/// "not locked: SEEN; expected EXPECTED; REMEDY". Of kLocked: "locked: SEEN". Of a clock that
/// follows all the same: "in doubt: SEEN; ...".
[[nodiscard]] std::string sentence(const Finding& finding);

}  // namespace ftcs::diagnosis
