// SPDX-License-Identifier: MIT
#include "ftcs/node/drive_supervision.h"

namespace ftcs::node {

using ethercat::AlState;
using ethercat::FailureKind;
using Kind = CycleNote::Kind;

std::string_view describe(SupervisionConfigError error) noexcept {
  switch (error) {
    case SupervisionConfigError::kUnlockedLimit:
      return "drives are stopped after one cycle without the lock or more";
    case SupervisionConfigError::kRecoveryInterval:
      return "between two recoveries of a drive lies one cycle or more";
  }
  return "unknown configuration error";
}

std::optional<SupervisionConfigError> validate(const DriveSupervisionConfig& config) noexcept {
  if (config.lock_policy == LockPolicy::kRecovering && config.unlocked_limit == 0) {
    return SupervisionConfigError::kUnlockedLimit;
  }
  if (config.recovery_interval == 0) return SupervisionConfigError::kRecoveryInterval;
  return std::nullopt;
}

void DriveSupervision::cycle(ethercat::MainDevice& main, CycleState state, bool ready,
                             CycleNotes& notes) noexcept {
  ++cycles_;
  const bool locked = state == CycleState::kLocked;
  watch_lock(main, locked, notes);
  watch_drives(main, notes);
  bring_to_op(main, locked, ready, notes);
}

void DriveSupervision::watch_lock(ethercat::MainDevice& main, bool locked,
                                  CycleNotes& notes) noexcept {
  using Change = LockWatch::Change;
  const Change change = lock_.update(locked);
  if (change == Change::kLocked) notes.add(Kind::kLocked);
  if (change == Change::kLost) notes.add(Kind::kLockLost);
  if (locked && lock_cycle_ < 0) lock_cycle_ = static_cast<std::int64_t>(cycles_);
  if (!followed_) return;
  const bool gave_up_waiting =
      asked_at_ == 0 && config_.await_limit > 0 && cycles_ >= config_.await_limit;
  if (gave_up_waiting) main.stop(FailureKind::kNeverLocked);
  const bool fatal = config_.lock_policy == LockPolicy::kFatal && lock_.without() > 0;
  const bool too_long =
      config_.lock_policy == LockPolicy::kRecovering && lock_.without() >= config_.unlocked_limit;
  if (fatal || too_long) main.stop(FailureKind::kSyncLost);
}

/// From OP on: who leaves it, and why; who comes back.
void DriveSupervision::watch_drives(const ethercat::MainDevice& main, CycleNotes& notes) noexcept {
  if (op_cycle_ < 0) return;
  if (main.counters().reintegrated != reintegrated_) {
    reintegrated_ = main.counters().reintegrated;
    notes.add(Kind::kReintegrated, reintegrating_);
  }
  reintegrating_ = main.reintegrating();
  for (std::size_t n = 0; n < main.network().count; ++n) {
    watch_drive(main.network().devices[n], n, notes);
  }
}

void DriveSupervision::watch_drive(const ethercat::SubDeviceInfo& device, std::size_t n,
                                   CycleNotes& notes) noexcept {
  const Seen now = device.state == AlState::kOp     ? Seen::kInOp
                   : device.state == AlState::kNone ? Seen::kOutOfReach
                                                    : Seen::kLeftOp;
  // On its way back a drive passes the lower states.
  const bool on_its_way = now == Seen::kLeftOp && seen_[n] == Seen::kOutOfReach && !device.error;
  if (now == seen_[n] || on_its_way) return;
  const bool first = seen_[n] == Seen::kNotYet;
  if (first && now != Seen::kInOp) return;  // not yet asked
  seen_[n] = now;
  if (first) return;
  notes.add(now == Seen::kInOp         ? Kind::kBackInOp
            : now == Seen::kOutOfReach ? Kind::kOutOfReach
                                       : Kind::kLeftOp,
            n, device.code);
}

/// OP once the cycle is locked; a SubDevice that left it is acknowledged and asked again.
void DriveSupervision::bring_to_op(ethercat::MainDevice& main, bool locked, bool ready,
                                   CycleNotes& notes) noexcept {
  const bool all_in_op = main.last_cycle().all_operational();
  if (op_cycle_ < 0 && all_in_op) op_cycle_ = static_cast<std::int64_t>(cycles_);
  const bool may_ask = locked || !config_.await_lock ||
                       (config_.lock_policy == LockPolicy::kAdvisory && asked_at_ > 0);
  if (!may_ask || all_in_op) return;
  if (asked_at_ == 0) {
    if (!ready) return;
    asked_at_ = cycles_;
    main.request_operational();
    notes.add(Kind::kOpRequested);
  }
  const std::uint64_t since = cycles_ - asked_at_;
  if (op_cycle_ < 0 && config_.op_limit > 0 && since >= config_.op_limit) {
    return main.stop(FailureKind::kNeverOperational);
  }
  if (since < config_.first_recovery || since % config_.recovery_interval != 0) return;
  for (std::size_t n = 0; n < main.network().count; ++n) main.recover(n);
}

}  // namespace ftcs::node
