// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/node/clock_follower.h"
#include "ftcs/node/follower_event.h"
#include "ftcs/node/reference_gate.h"
#include "ftcs/ptp/actions.h"
#include "ftcs/ptp/time_receiver.h"

namespace ftcs::node {

/// The port and what follows it. Valid: ptp::TimeReceiverConfig as it says of its fields;
/// validate(follower.discipline.servo) finds nothing. Not checked here.
struct ReceiverNodeConfig {
  ptp::TimeReceiverConfig port{};
  ClockFollowerConfig follower{};  ///< peer_to_peer is taken from the port's delay_mechanism
};

/// Either something to be done or told outside (never ptp::EmitPair nor ptp::EmitPeerDelay: those
/// stay inside), or what the clock's side of the node did.
using ReceiverEvent = std::variant<ptp::Action, Steered, Note>;

/// A clock that follows a PTP time transmitter, from octets to commands:
///
///     octets, stamps ─► ptp::TimeReceiver ─► ClockFollower ─► ClockDiscipline ─► AdjustableClock
///                             ▲                                     │
///                             └──────── locked, not locked ─────────┘
///
/// Without I/O: the daemon and the simulator feed the same object. `now` and event stamps are
/// readings of the free-running oscillator; `now` must not run backward. After each input the
/// events are to be taken with next() until there is none. Work is done event by event: who changes
/// the clock's timescale upon ptp::TransmitterSelected (on_new_reference(), on_new_timescale())
/// does so before the first pair of that transmitter is steered.
///
///     ReceiverNode node(config, clock);                        // examples/04_ptp_receiver.cpp
///     node.start(now());
///     for (;;) {
///       wait_for_octets_until(node.deadline());
///       node.on_event_message(octets, received, now());        // or the input that it was
///       node.on_silence(now());
///       while (const auto event = node.next()) act_on(*event); // send what is to be sent, tell
///     }
///
/// IEEE 1588-2019: an ordinary clock that only receives, one port; corrections and asymmetry as
/// 11.6 has them, 11.3 or 11.4 for the delay, 9.2.5 for the port's state, in which SLAVE means that
/// the servo is locked. What the standard leaves open: docs/spec-notes/ieee1588.md.
///
/// One thread owns node, clock and gate. The octets are read during the call alone. Nothing waits,
/// nothing is allocated; one input makes a bounded number of events.
class ReceiverNode {
 public:
  /// Clock and gate must outlive the node; without a gate everything may steer. The node is the
  /// only one that commands the clock.
  ReceiverNode(const ReceiverNodeConfig& config, AdjustableClock& clock,
               ReferenceGate* gate = nullptr) noexcept;

  /// Before the first message: a rate that is known already (a driftfile's), local per free
  /// running. The clock's error, if it did not take it; the node may run all the same.
  [[nodiscard]] std::optional<ClockError> start_at(Rate rate) noexcept {
    return follower_.start_at(rate);
  }
  /// Inputs of ptp::TimeReceiver, which see. An input whose predecessor's events have not all been
  /// taken drops the rest of the actions: messages that are not sent.
  void start(FreeRunningTime now) noexcept;
  /// Octets from the PTP header on, and when the message timestamp point passed the reference plane
  /// of the interface (7.3.4), on the free-running oscillator.
  void on_event_message(std::span<const std::uint8_t> bytes, FreeRunningTime received,
                        FreeRunningTime now) noexcept;
  void on_general_message(std::span<const std::uint8_t> bytes, FreeRunningTime now) noexcept;
  void on_transmit_timestamp(const ptp::EventId& id, FreeRunningTime sent,
                             FreeRunningTime now) noexcept;
  void on_transmit_timestamp_missing(const ptp::EventId& id, FreeRunningTime now) noexcept;
  /// At deadline() or later; too early does no harm.
  void on_timer(FreeRunningTime now) noexcept;
  void on_link_down(FreeRunningTime now) noexcept;
  void on_link_up(FreeRunningTime now) noexcept;
  /// Once per turn of the loop, and at least every second: notices that Syncs have stopped. The
  /// port goes from SLAVE to UNCALIBRATED when the lock is lost (9.2.5, SYNCHRONIZATION_FAULT).
  void on_silence(FreeRunningTime now) noexcept;
  /// What was learnt about the reference is void. May stand between two calls of next().
  void on_new_reference() noexcept { follower_.on_new_reference(); }
  /// The steered clock was put onto another timescale. May stand between two calls of next().
  void on_new_timescale() noexcept { follower_.on_new_timescale(); }

  /// What the inputs brought about, in order; none: all is done.
  [[nodiscard]] std::optional<ReceiverEvent> next() noexcept;

  /// When on_timer() must be called, if no other input comes first.
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const noexcept {
    return port_.deadline();
  }
  /// The offset stays within the band of the lock (LockConfig), samples come, and the path delay is
  /// known.
  [[nodiscard]] bool locked() const noexcept { return follower_.locked(); }
  /// For reading: state, transmitter, counters.
  [[nodiscard]] const ptp::TimeReceiver& port() const noexcept { return port_; }
  [[nodiscard]] const ClockDiscipline& discipline() const noexcept {
    return follower_.discipline();
  }

 private:
  void take(const ptp::ActionList& actions, FreeRunningTime now) noexcept;
  [[nodiscard]] bool keeps(const ptp::Action& action) noexcept;
  void heed(const Note& told) noexcept;
  void count_refusals(const Telemetry& telemetry) noexcept;
  void tell_port_of_lock(FreeRunningTime now) noexcept;
  void tell_port_of_pair(FreeRunningTime now) noexcept;

  ptp::TimeReceiver port_;
  ClockFollower follower_;
  bool had_transmitter_ = false;
  FreeRunningTime now_{};  ///< of the last input
  ptp::ActionList actions_{};
  std::size_t taken_ = 0;           ///< of actions_
  ptp::ActionList lock_actions_{};  ///< what the port makes of locked or not
  std::size_t lock_actions_taken_ = 0;
  /// In a row; with so many the transmitter is doubted.
  static constexpr int kRefusalsToDoubt = 3;
  int refusals_ = 0;
  bool pair_was_fed_ = false;  ///< and the port does not know yet what came of it
};

}  // namespace ftcs::node
