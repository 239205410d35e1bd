// SPDX-License-Identifier: MIT
#include "ftcs/node/receiver_node.h"

#include <utility>

namespace ftcs::node {
namespace {

ClockFollowerConfig follower_config(const ReceiverNodeConfig& config) noexcept {
  ClockFollowerConfig follower = config.follower;
  follower.peer_to_peer = config.port.delay_mechanism == ptp::DelayMechanism::kPeerToPeer;
  return follower;
}

}  // namespace

ReceiverNode::ReceiverNode(const ReceiverNodeConfig& config, AdjustableClock& clock,
                           ReferenceGate* gate) noexcept
    : port_(config.port), follower_(follower_config(config), clock, gate) {}

void ReceiverNode::start(FreeRunningTime now) noexcept { take(port_.start(now), now); }

void ReceiverNode::on_event_message(std::span<const std::uint8_t> bytes, FreeRunningTime received,
                                    FreeRunningTime now) noexcept {
  take(port_.on_event_message(bytes, received, now), now);
}

void ReceiverNode::on_general_message(std::span<const std::uint8_t> bytes,
                                      FreeRunningTime now) noexcept {
  take(port_.on_general_message(bytes, now), now);
}

void ReceiverNode::on_transmit_timestamp(const ptp::EventId& id, FreeRunningTime sent,
                                         FreeRunningTime now) noexcept {
  take(port_.on_transmit_timestamp(id, sent, now), now);
}

void ReceiverNode::on_transmit_timestamp_missing(const ptp::EventId& id,
                                                 FreeRunningTime now) noexcept {
  take(port_.on_transmit_timestamp_missing(id, now), now);
}

void ReceiverNode::on_timer(FreeRunningTime now) noexcept { take(port_.on_timer(now), now); }
void ReceiverNode::on_link_down(FreeRunningTime now) noexcept {
  take(port_.on_link_down(now), now);
}
void ReceiverNode::on_link_up(FreeRunningTime now) noexcept { take(port_.on_link_up(now), now); }

// Only a sample can say that the clock is locked again.
void ReceiverNode::on_silence(FreeRunningTime now) noexcept {
  follower_.on_silence();
  if (!locked()) take(port_.on_servo_unlocked(now), now);
}

void ReceiverNode::take(const ptp::ActionList& actions, FreeRunningTime now) noexcept {
  now_ = now;
  actions_ = actions;
  taken_ = 0;
}

std::optional<ReceiverEvent> ReceiverNode::next() noexcept {
  for (;;) {
    if (const auto event = follower_.next()) {
      if (const auto* steered = std::get_if<Steered>(&*event)) count_refusals(steered->telemetry);
      if (const auto* told = std::get_if<Note>(&*event)) heed(*told);
      return std::visit([](const auto& told) { return ReceiverEvent{told}; }, *event);
    }
    if (std::exchange(pair_was_fed_, false)) tell_port_of_pair(now_);
    if (lock_actions_taken_ < lock_actions_.size()) return lock_actions_[lock_actions_taken_++];
    if (taken_ == actions_.size()) return std::nullopt;
    const ptp::Action& action = actions_[taken_++];
    if (!keeps(action)) return action;
  }
}

/// True: it is for the inside alone.
bool ReceiverNode::keeps(const ptp::Action& action) noexcept {
  if (const auto* emitted = std::get_if<ptp::EmitPair>(&action)) {
    follower_.on_pair(emitted->pair, port_.sync_interval());
    pair_was_fed_ = true;
    return true;
  }
  if (const auto* delay = std::get_if<ptp::EmitPeerDelay>(&action)) {
    follower_.on_link_delay(*delay, port_.sync_interval());
    return true;
  }
  if (const auto* change = std::get_if<ptp::PortStateChanged>(&action)) {
    if (change->to == ptp::PortState::kFaulty) follower_.on_new_link();
  } else if (const auto* selected = std::get_if<ptp::TransmitterSelected>(&action)) {
    if (selected->changed && std::exchange(had_transmitter_, true)) follower_.on_new_reference();
  } else if (const auto* jumped = std::get_if<ptp::ReferenceJumped>(&action)) {
    follower_.on_reference_jump(jumped->jump);
  }
  return false;
}

// Holdover although Syncs come: they tell nothing that could be followed.
void ReceiverNode::heed(const Note& told) noexcept {
  if (told.kind != NoteKind::kHoldover || told.refused_syncs < kRefusalsToDoubt) return;
  refusals_ = kRefusalsToDoubt;
  pair_was_fed_ = true;
}

void ReceiverNode::count_refusals(const Telemetry& telemetry) noexcept {
  if (telemetry.commanded) refusals_ = 0;
  if (telemetry.offset_refused) ++refusals_;
}

// A transmitter whose time is refused again and again makes room for any other.
void ReceiverNode::tell_port_of_pair(FreeRunningTime now) noexcept {
  if (refusals_ < kRefusalsToDoubt) return tell_port_of_lock(now);
  refusals_ = 0;
  lock_actions_ = port_.on_transmitter_doubted(now);
  lock_actions_taken_ = 0;
}

// From the port's state and not from a change of the lock: after a fault shorter than the lock's
// patience the port comes back uncalibrated while the clock has been locked all along. After a
// longer one it has not: that is told in every state.
void ReceiverNode::tell_port_of_lock(FreeRunningTime now) noexcept {
  if (!locked()) {
    lock_actions_ = port_.on_servo_unlocked(now);
  } else if (port_.state() == ptp::PortState::kUncalibrated) {
    lock_actions_ = port_.on_servo_locked(now);
  } else {
    return;
  }
  lock_actions_taken_ = 0;
}

}  // namespace ftcs::node
