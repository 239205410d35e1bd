// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/ethercat/wire/al_state.h"
#include "ftcs/sim/drives/dc_unit.h"
#include "ftcs/sim/drives/drive_motor.h"
#include "ftcs/sim/drives/esc_memory.h"
#include "ftcs/sim/drives/object_dictionary.h"

namespace ftcs::ethercat {

/// Where the outputs of a cycle stood in relation to SYNC0: the margin is SYNC0 minus arrival of
/// the frame, in the system time of the SubDevice.
struct SyncStatistics {
  static constexpr std::size_t kBins = 64;
  std::uint64_t events = 0;  ///< SYNC0 events in OP
  std::uint64_t missed = 0;  ///< of them without new outputs
  std::int64_t last_margin_ns = 0;
  std::int64_t smallest_margin_ns = INT64_MAX;
  std::int64_t largest_margin_ns = INT64_MIN;
  /// Margins over the cycle time, [0, 1) in 64 bins; longer ones in the last.
  std::array<std::uint32_t, kBins> histogram{};
};

/// An AL status code that was raised, and how often.
struct DriveFault {
  AlStatusCode code = AlStatusCode::kNoError;
  std::uint32_t count = 0;
};

/// The application of the modelled drive, on the far side of the controller's memory: the AL state
/// machine with its checks (ETG.1000.6, 6.4), supervision of SYNC0 (ETG.1020), CoE, and the motor.
///
/// What it raises, as drives do:
///   0x0011 / 0x0012 / 0x0013  a request that skips a state, is unknown, or asks for bootstrap
///   0x0016                    PREOP without both mailbox sync managers
///   0x001D / 0x001E           SAFEOP with a sync manager that does not fit 0x1C12 / 0x1C13
///   0x0030 / 0x0035 / 0x0036  SAFEOP with 0x1C32:01 = SYNC0 but no SYNC0; its cycle against
///   0x1C32:02;
///                             its cycle too short or against 0x60C2
///   0x002D                    OP asked for, but SYNC0 does not come
///   0x001A                    SYNC0 without new outputs too often (0x10F1:02)
///   0x0032                    SYNC0 too unsteady for the drive's own loop
///   0x001B                    no outputs for the time of the watchdog
class DriveApplication {
 public:
  DriveApplication(EscMemory& memory, const Identity& identity,
                   DeviceKind kind = DeviceKind::kDrive) noexcept
      : memory_(memory), objects_(identity, kind) {}

  void power_on(Duration now) noexcept;
  /// AL control was written.
  void request_state(std::uint16_t control, Duration now) noexcept;
  /// New outputs are in the memory of sync manager 2.
  void on_outputs(std::uint64_t system_time, Duration now) noexcept;
  void on_sync0(const Sync0Event& event) noexcept;
  /// Watchdog and transitions that wait; `now` is the crystal.
  void tick(Duration now) noexcept;
  /// Of a bridge terminal: what the clocks of both sides showed at one instant; none: the other
  /// side is not connected.
  void show_stamps(std::uint64_t internal, std::optional<std::uint64_t> external) noexcept;
  /// Answers a request in mailbox 0 if mailbox 1 is free.
  void serve_mailbox() noexcept;

  [[nodiscard]] AlState state() const noexcept { return state_; }
  [[nodiscard]] AlStatusCode code() const noexcept { return code_; }
  [[nodiscard]] const SyncStatistics& statistics() const noexcept { return statistics_; }
  /// All that was raised since the model was made, in the order of first appearance; the supply
  /// does not matter.
  [[nodiscard]] std::span<const DriveFault> faults() const noexcept {
    return {faults_.data(), fault_kinds_};
  }
  [[nodiscard]] const DriveMotor& motor() const noexcept { return motor_; }
  [[nodiscard]] DriveMotor& motor() noexcept { return motor_; }
  [[nodiscard]] const ObjectDictionary& objects() const noexcept { return objects_; }

 private:
  void enter(AlState state) noexcept;
  void refuse(AlStatusCode code) noexcept;
  void remember(AlStatusCode code) noexcept;
  void fail(AlStatusCode code) noexcept;
  void publish_state() noexcept;
  void publish_inputs() noexcept;
  void sample_motor() noexcept;
  void begin_op(Duration now) noexcept;
  [[nodiscard]] AlStatusCode check_mailbox() const noexcept;
  [[nodiscard]] AlStatusCode check_process_data() const noexcept;
  [[nodiscard]] AlStatusCode check_sync() const noexcept;
  [[nodiscard]] Duration watchdog_time() const noexcept;
  void supervise(const Sync0Event& event, bool fresh) noexcept;
  void record_margin(const Sync0Event& event, bool fresh) noexcept;
  [[nodiscard]] Sdo answer(const Sdo& request, ObjectDictionary::Upload& upload) noexcept;

  EscMemory& memory_;
  ObjectDictionary objects_;
  DriveMotor motor_;

  AlState state_ = AlState::kInit;
  AlStatusCode code_ = AlStatusCode::kNoError;
  bool error_ = false;

  bool op_requested_ = false;
  Duration op_deadline_{};
  unsigned good_cycles_ = 0;  ///< SYNC0 events with fresh outputs since OP was asked for
  unsigned sync0_since_request_ = 0;
  bool synchronous_ = false;  ///< SYNC0 was active when SAFEOP was entered

  bool fresh_outputs_ = false;
  std::uint64_t outputs_at_ = 0;
  Duration outputs_crystal_{};
  std::uint32_t error_counter_ = 0;
  unsigned unsteady_ = 0;
  Duration last_sync0_{};
  SyncStatistics statistics_;
  static constexpr std::size_t kFaultKinds = 16;
  std::array<DriveFault, kFaultKinds> faults_{};
  std::size_t fault_kinds_ = 0;
};

}  // namespace ftcs::ethercat
