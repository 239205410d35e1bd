// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "ftcs/discipline/cycle_servo_types.h"
#include "ftcs/discipline/lock_watch.h"
#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/node/cycle_notes.h"

namespace ftcs::node {

/// What a lost lock does to drives that run.
enum class LockPolicy : std::uint8_t {
  kAdvisory,    ///< it is told, the drives go on
  kRecovering,  ///< the cycle has unlocked_limit to find its lock again, then the drives are
                ///< stopped
  kFatal,       ///< the drives are stopped at once
};

/// Limits in cycles. Valid: validate() finds nothing.
struct DriveSupervisionConfig {
  LockPolicy lock_policy = LockPolicy::kRecovering;
  std::uint64_t unlocked_limit = 10'000;
  /// OP is asked for when the cycle is locked. False: with the first cycle.
  bool await_lock = true;
  /// Without a first lock, or not ready, for so long everything is stopped. Zero: wait for ever.
  std::uint64_t await_limit = 0;
  /// From asking for OP to the first recovery of a drive that is not in it, and between two.
  std::uint64_t first_recovery = 1000;
  std::uint64_t recovery_interval = 100;
  /// From asking for OP to the first cycle with all in it, else everything is stopped: a drive that
  /// is asked again and again may never be able to. Zero: asked for ever.
  std::uint64_t op_limit = 30'000;
};

/// Why a DriveSupervisionConfig cannot work.
enum class SupervisionConfigError : std::uint8_t {
  kUnlockedLimit,     ///< zero: drives would be stopped that never lost a lock
  kRecoveryInterval,  ///< zero: no cycle is a multiple of it
};
/// One sentence: what was expected.
[[nodiscard]] std::string_view describe(SupervisionConfigError error) noexcept;
/// The first thing that is wrong. unlocked_limit is asked of kRecovering alone.
[[nodiscard]] std::optional<SupervisionConfigError> validate(
    const DriveSupervisionConfig& config) noexcept;

/// When drives are asked for OP, helped back into it and stopped: SAFEOP to OP waits for the lock
/// of the cycle; who left OP is acknowledged and asked again; a lock that does not come back stops
/// all (LockPolicy). Frames and working counters are the MainDevice's own affair.
///
///     no lock within await_limit        stop, FailureKind::kNeverLocked
///     not all in OP within op_limit     stop, kNeverOperational
///     lock lost for unlocked_limit      stop, kSyncLost (kRecovering; kFatal: at once)
///
/// Without a law (`followed` false) the lock stops nothing; op_limit does.
class DriveSupervision {
 public:
  /// Valid: validate(config) finds nothing; it is not asked here.
  /// `followed`: the cycle has a law, so that its lock means something.
  DriveSupervision(const DriveSupervisionConfig& config, bool followed) noexcept
      : config_(config), followed_(followed) {}

  /// Once in a cycle, after its frame and the servo's decision. `ready`: besides the lock nothing
  /// speaks against OP.
  void cycle(ethercat::MainDevice& main, CycleState state, bool ready, CycleNotes& notes) noexcept;

  [[nodiscard]] const LockWatch& lock() const noexcept { return lock_; }
  /// Number of the first cycle that was locked, and that saw all in OP; -1: none yet.
  [[nodiscard]] std::int64_t lock_cycle() const noexcept { return lock_cycle_; }
  [[nodiscard]] std::int64_t op_cycle() const noexcept { return op_cycle_; }

 private:
  void watch_lock(ethercat::MainDevice& main, bool locked, CycleNotes& notes) noexcept;
  void watch_drives(const ethercat::MainDevice& main, CycleNotes& notes) noexcept;
  void watch_drive(const ethercat::SubDeviceInfo& device, std::size_t n,
                   CycleNotes& notes) noexcept;
  void bring_to_op(ethercat::MainDevice& main, bool locked, bool ready, CycleNotes& notes) noexcept;

  enum class Seen : std::uint8_t { kNotYet, kInOp, kLeftOp, kOutOfReach };

  DriveSupervisionConfig config_;
  bool followed_;
  LockWatch lock_;
  std::uint64_t cycles_ = 0;
  std::int64_t lock_cycle_ = -1;
  std::int64_t op_cycle_ = -1;
  std::uint64_t asked_at_ = 0;  ///< cycle in which OP was asked for; zero: not yet
  std::array<Seen, ethercat::kMaxSubDevices> seen_{};
  std::uint32_t reintegrated_ = 0;
  std::size_t reintegrating_ = CycleNote::kNobody;  ///< in the last cycle
};

}  // namespace ftcs::node
