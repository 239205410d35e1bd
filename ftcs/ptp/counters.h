// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "ftcs/ptp/wire/codec.h"

namespace ftcs::ptp {

/// Everything that a port counts. What reaction belongs to each is said here; names are stable
/// (to_string).
enum class Counter : std::uint8_t {
  // Received and used.
  kAnnounceReceived,
  kSyncReceived,
  kFollowUpReceived,
  kDelayReqReceived,
  kDelayRespReceived,
  kPdelayReqReceived,
  kPdelayRespReceived,
  kPdelayRespFollowUpReceived,
  kAuthenticated,  ///< of those, and of those that are dropped below
  // Sent.
  kAnnounceSent,
  kSyncSent,
  kFollowUpSent,
  kDelayReqSent,
  kDelayRespSent,
  kPdelayReqSent,
  kPdelayRespSent,
  kPdelayRespFollowUpSent,
  // Given to the servo.
  kForwardPairs,
  kBackwardPairs,
  kPeerDelays,
  // Refused by the decoder: the message is dropped.
  kTruncated,
  kOversized,
  kWrongVersion,
  kUnknownType,
  kWrongLength,
  kBadTimestamp,
  kMalformedTlv,
  // Not authentic (16.14), where a security association is asked for: the message is dropped.
  kAuthenticationMissing,      ///< no AUTHENTICATION TLV
  kAuthenticationUnsupported,  ///< of delayed processing, or not as long as its key says
  kAuthenticationUnknownKey,   ///< another SPP, or a keyID that the association does not have
  kAuthenticationWrongCode,    ///< another key under this number, or a changed message
  kReplayed,  ///< authentic, but of a sequenceId that has passed or is beyond the window
  // Not for us: the message is dropped.
  kWrongSdo,
  kWrongDomain,
  kOwnMessage,            ///< our own multicast, looped back
  kWrongTransmitter,      ///< Sync, Follow_Up or Delay_Resp of a port that is not selected
  kWrongRequestingPort,   ///< Delay_Resp to another receiver
  kNotForThisRole,        ///< as a Delay_Req at a receiver or a Sync at a transmitter
  kAlternateTransmitter,  ///< alternateMasterFlag is set (17.3)
  kManagementIgnored,
  kSignalingIgnored,
  kPdelayIgnored,  ///< peer delay messages at a port that measures end to end
  kDelayIgnored,   ///< Delay_Req and Delay_Resp at a port that measures peer to peer
  kWrongChannel,   ///< event message without a receive stamp, as it came on the general port
  kNotListening,   ///< while initializing, faulty or without a selected transmitter
  // Order and loss of Sync and Follow_Up.
  kMissedSync,             ///< gaps in the sequence; nothing to do
  kDuplicateSync,          ///< second copy dropped
  kDuplicateFollowUp,      ///< second copy dropped
  kEarlyFollowUp,          ///< before its Sync, while somebody forges such: dropped
  kContradictingFollowUp,  ///< tells another time than one before it for the same Sync: dropped
  kStaleSync,              ///< older than one that came before: dropped
  kStaleFollowUp,     ///< its pair would be older than one already emitted, or its Sync is unknown:
                      ///< dropped
  kSequenceRestarts,  ///< a leap of the sequence, as after a restart: unmatched messages are
                      ///< forgotten
  kLostFollowUp,      ///< a two-step Sync whose Follow_Up did not come in time: forgotten
  kLostSync,          ///< a Follow_Up whose Sync did not come in time: forgotten
  // Requests of others.
  kAnswersRefused,  ///< beyond what one sender is answered (AnswerLimit): dropped
  // Delay request and response.
  kStaleDelayResp,  ///< nothing outstanding with this sequence id (late, duplicate or forged):
                    ///< dropped
  kLostDelayResp,   ///< a request that was never answered: forgotten
  kMissingTransmitStamp,     ///< overdue: the exchange (receiver) or the Follow_Up (transmitter) is
                             ///< left out until it comes
  kUnexpectedTransmitStamp,  ///< for a message that we do not wait for: ignored
  // Peer delay (11.4).
  kLostPdelayResp,          ///< a request that was never answered: forgotten
  kLostPdelayRespFollowUp,  ///< a two-step answer whose Follow_Up did not come: forgotten
  kStalePdelayResp,         ///< an answer to no open request (late, duplicate or forged): dropped
  kDuplicatePdelayReq,      ///< second copy of a request: answered once
  kWrongPeer,               ///< a Pdelay_Resp_Follow_Up of another port than the answer: dropped
  kSeveralResponders,       ///< two ports answer one request: what is there is no link between two
                            ///< ports.
                            ///< No delay is taken until three requests have had one answer each
  kAbsurdPeerDelay,         ///< beyond ±kMaximumPeerDelay: dropped
  kPeerRateRestarts,        ///< the neighbour's clock was stepped: its rate is measured anew
  kNotCapable,  ///< Announce, Sync and Follow_Up that were dropped as the neighbour is not (yet)
                ///< known
                ///< to speak IEEE 802.1AS (asCapable)
  // Values.
  kNegativeCorrection,  ///< used: 11.6 may make it negative
  kAbsurdCorrection,    ///< beyond kMaximumCorrection: the message is dropped
  kBadInterval,         ///< logMessageInterval outside of the profile: the old value stays
  kDoubtedTime,  ///< a time that contradicts the Syncs before, not yet said often enough: dropped
  kReferenceJumps,  ///< the reference leapt against our oscillator: reported, open exchanges are
                    ///< forgotten
  kUnusableTime,    ///< a time that no Timestamp can carry: the message is not sent
  kNotSealed,       ///< no authentication code could be computed: the message is not sent
  // Transmitters.
  kTransmitterChanges,
  kAnnounceTimeouts,  ///< the selected transmitter stopped: back to LISTENING, or to the next best
                      ///< one
  kDoubtedTransmitters,  ///< the selected one tells a time that was refused: others are preferred
  kForeignTableFull,     ///< a newcomer was ignored
  kSyncTimeouts,  ///< its Syncs stopped while it still announces (syncReceiptTimeout): as above
  kUnacceptableTransmitter,  ///< not in the table of acceptable ones (17.5): dropped
  kUnusableAnnounce,  ///< 255 steps removed or more, or a clock that claims our identity (9.3.2.5)
  kLinkDown,
  kActionsDropped,  ///< more actions at once than the list holds; a test shows that it stays zero
};
inline constexpr std::size_t kCounters = static_cast<std::size_t>(Counter::kActionsDropped) + 1;

/// "wrong_domain": the enumerator's words in lower case. Stable: status files and tests refer to
/// them.
[[nodiscard]] std::string_view to_string(Counter counter) noexcept;

/// The counter of a decoder's error.
[[nodiscard]] Counter counter_of(DecodeReason reason) noexcept;

/// Counts since construction; they only grow.
class Counters {
 public:
  constexpr void add(Counter counter, std::uint64_t times = 1) noexcept {
    values_[static_cast<std::size_t>(counter)] += times;
  }
  [[nodiscard]] constexpr std::uint64_t operator[](Counter counter) const noexcept {
    return values_[static_cast<std::size_t>(counter)];
  }

 private:
  std::array<std::uint64_t, kCounters> values_{};
};

}  // namespace ftcs::ptp
