// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

#include "ftcs/ptp/port_state.h"
#include "ftcs/ptp/wire/codec.h"
#include "ftcs/time/rate.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::ptp {

/// UDP ports 319 and 320 (Annexes C and D). Event messages need a transmit stamp.
enum class Channel : std::uint8_t { kEvent, kGeneral };

/// Where to: the shell knows the addresses, the core does not.
enum class Destination : std::uint8_t {
  kMulticast,    ///< everybody: 224.0.1.129, ff0X::181, 01-1B-19-00-00-00 (Annexes C to E)
  kNeighbour,    ///< peer delay messages: 224.0.0.107, ff02::6b, 01-80-C2-00-00-0E
  kPeer,         ///< the one address that the configuration names
  kSender,       ///< where the message came from that is being handled
  kTransmitter,  ///< where the message came from with which SenderIsTransmitter came last
};

/// Send these octets. For Channel::kEvent the shell answers with on_transmit_timestamp(id, ...) or,
/// if the stamp is overdue, on_transmit_timestamp_missing(id, ...), which a late stamp may follow.
struct SendMessage {
  Channel channel = Channel::kGeneral;
  Destination destination = Destination::kMulticast;
  MessageType type = MessageType::kSync;
  std::uint16_t sequence_id = 0;
  MessageBytes bytes{};
  [[nodiscard]] EventId id() const noexcept { return event_id(bytes.view()); }
};

/// The message that is being handled came from the followed transmitter: where it came from is the
/// transmitter's address (Destination::kTransmitter).
struct SenderIsTransmitter {};

/// One timestamped message between the two clocks, for the servo.
struct EmitPair {
  EventPair pair{};
};

/// What a Pdelay_Req and its Pdelay_Resp say of the time, in the order of their events.
struct PeerStamps {
  EventPair request{};   ///< t1 by our clock, t2 by the neighbour's: backward
  EventPair response{};  ///< t3 by the neighbour's clock, t4 by ours: forward
};

/// One exchange of peer delay messages (11.4), for the measurement.
struct EmitPeerDelay {
  Duration mean_link_delay{};  ///< without asymmetry, by the reference, else the neighbour
  Rate neighbor_rate_ratio;    ///< of the neighbour's clock in units of ours; 1 until known
  bool first = false;          ///< the first one of this link: what was measured before is void
  /// Where the neighbour is the followed transmitter and has told both stamps: if they are of the
  /// timescale of its Syncs, the exchange measures time, as Delay_Req and Sync do.
  std::optional<PeerStamps> stamps{};
};

/// For the log, and for whoever shows the port's state; already done.
struct PortStateChanged {
  PortState from = PortState::kInitializing;
  PortState to = PortState::kInitializing;
  PortEvent event = PortEvent::kInitComplete;
};

/// A transmitter that was not known is heard for the first time ("new foreign master").
struct TransmitterSeen {
  PortIdentity port{};
};

/// What a transmitter says about itself and its grandmaster.
struct TransmitterData {
  PortIdentity port{};
  Announce announce{};
  std::uint16_t flags = 0;  ///< flag::kPtpTimescale, kUtcOffsetValid, kLeap61 ...
  friend constexpr bool operator==(const TransmitterData&,
                                   const TransmitterData&) noexcept = default;
};

/// The best transmitter: when it is selected, and with each of its Announces.
struct TransmitterSelected {
  TransmitterData transmitter{};
  bool changed = false;  ///< port or grandmaster differ from the last selection: another reference
};

/// The selected transmitter tells a time that nobody wants to follow; any other is preferred.
struct TransmitterDoubted {
  PortIdentity port{};
};

/// The reference advanced differently from our oscillator by more than kJumpTolerance, and several
/// Syncs agree (ReferenceWatch); the pair that follows already shows the new time. Positive: the
/// reference leapt forward.
struct ReferenceJumped {
  Duration jump{};
};

/// One thing to be done (SendMessage), to be given to measurement and servo (EmitPair,
/// EmitPeerDelay), or to be told (the others).
using Action =
    std::variant<SendMessage, EmitPair, EmitPeerDelay, SenderIsTransmitter, PortStateChanged,
                 TransmitterSeen, TransmitterSelected, TransmitterDoubted, ReferenceJumped>;

/// What an input brought about, in order. A value: actions may feed new inputs while the list is
/// walked.
class ActionList {
 public:
  /// The longest list (the first Announce at a time receiver that has kept four pairs) has seven.
  static constexpr std::size_t kCapacity = 8;

  /// False if there is no room.
  constexpr bool push(const Action& action) noexcept {
    if (size_ == kCapacity) return false;
    actions_[size_++] = action;
    return true;
  }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] constexpr const Action& operator[](std::size_t i) const noexcept {
    return actions_[i];
  }
  [[nodiscard]] constexpr const Action* begin() const noexcept { return actions_.data(); }
  [[nodiscard]] constexpr const Action* end() const noexcept { return actions_.data() + size_; }

 private:
  std::array<Action, kCapacity> actions_{};
  std::size_t size_ = 0;
};

}  // namespace ftcs::ptp
