// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/discipline/bus_clock.h"
#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/ethercat/maindevice/csp_profile.h"
#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/node/bridge_clock.h"
#include "ftcs/node/cycle_notes.h"
#include "ftcs/node/drive_axes.h"
#include "ftcs/node/drive_clocks.h"
#include "ftcs/node/drive_supervision.h"

namespace ftcs::node {

/// Who follows whom. The names in brackets are the field's.
enum class BusMode : std::uint8_t {
  kFollow,    ///< the cycle follows the drives, nobody moves them (master shift)
  kLead,      ///< the cycle runs on plant time, the drives follow (bus shift)
  kExternal,  ///< the cycle follows the drives, the drives follow plant time (DCX, external sync)
};

/// How the bus is moved, where it is (decision 0017 has the figures).
enum class BusWrite : std::uint8_t {
  kOffset,      ///< increments of 0x0920: a difference has no lateness
  kTargetTime,  ///< plant time of the cycle's own instant to 0x0910, as IgH: late as the frame is
  kReadTime,    ///< plant time as read before the frame is sent to 0x0910: late as the stack is
};

/// A segment, its cycle and who follows whom. Valid as each part says of its fields: validate() of
/// supervision and of CycleNode::bus_config(); not asked here. servo.cycle is the cycle of
/// everything, servo.shift its place on the grid of system time.
struct CycleNodeConfig {
  /// Its process.objects, cycle and sync0_shift are set by the node. Where process.bridge has a
  /// value, plant time is that of a bridge terminal, whatever the stamps of the frames bring.
  ethercat::MainDeviceConfig main;
  CycleServoConfig servo;
  double sync0_phase =
      0.5;  ///< SYNC0 comes this part of a cycle after the frame's own place; 0 to 1
  /// 0x10F1:02 of the drives: a missed SYNC0 window counts three, a good one takes one off, and the
  /// drive faults above the limit; 0: never. No value: what the drive has of itself.
  std::optional<std::uint16_t> sync_error_limit;
  /// SYNC signals of single drives, by position on the wire.
  std::array<ethercat::DriveSync, ethercat::kMaxSubDevices> drive_sync{};
  /// |0x092C| above which the clock of a drive counts as off; zero: none does.
  Nanoseconds difference_limit{1'000};
  BusMode bus_mode = BusMode::kFollow;
  BusWrite bus_write = BusWrite::kOffset;
  /// Its steer, cycle and sync0_phase are set by the node, its sample_interval is at least a cycle.
  BusClockConfig bus;
  DriveSupervisionConfig supervision;
  DriveAxesConfig axes;
};

/// One EtherCAT segment and the cycle that follows its distributed clock, without I/O: the
/// MainDevice, the cycle servo, the axes and the rules between them. Frames, stamps and instants of
/// the host in; frames, the next wake-up and notes out.
///
///   while (!node.cyclic() && !node.stopped())      bring-up: as fast as frames come back
///     send(node.next_frame()); node.on_frame(...) or node.on_timeout();
///   wake = node.start(now).wake;
///   while (!node.stopped())                        one cycle
///     wait(wake); send(node.begin_cycle(now)); node.on_frame(...);
///     wake = node.end_cycle(stamps, now).wake;
///
/// After stop(), or when a rule stopped the drives, next_frame() sends them to SAFEOP until
/// stopped() is true. Some 100 KB; nothing is allocated. Not to be copied: the configuration of the
/// drives refers to the node's own memory.
///
/// Times of one cycle, all of them of the reference's system time S, T the cycle:
///
///     frame    S = m T + shift                                 the trigger of the cycle servo
///     SYNC0    S = m T + shift + sync0_phase T                 start time 0x0990, cycle 0x09A0
///     margin   from the frame's passage to SYNC0, in [0, T)    margin_ns()
///
/// Offsets: E is positive when the cycle comes early (CycleServo); bus().dc_to_plant is positive
/// when the bus is ahead of plant time. Sources: ETG.1000.4 (distributed clocks), ETG.1020
/// (synchronisation, 0x10F1), CiA 402 (axes), decision 0017 (how the bus is moved).
///
/// One thread, at the pace of the cycle; the work of each call is bounded.
class CycleNode {
 public:
  explicit CycleNode(const CycleNodeConfig& config) noexcept;
  /// What the bus clock of such a node is made with.
  [[nodiscard]] static BusClockConfig bus_config(const CycleNodeConfig& config) noexcept;
  CycleNode(const CycleNode&) = delete;
  CycleNode& operator=(const CycleNode&) = delete;

  /// During bring-up and the way down, and in the cyclic part by begin_cycle(): what is to be sent,
  /// from the EtherCAT header on; valid until the next call, empty when stopped.
  [[nodiscard]] ethercat::ConstBytes next_frame() noexcept { return main_.next_frame(); }
  /// What came back; kIgnored: not the answer that is waited for.
  ethercat::FrameOutcome on_frame(ethercat::Bytes frame,
                                  const ethercat::FrameStamps& stamps) noexcept {
    return main_.on_frame(frame, stamps);
  }
  /// It does not come any more. In the cyclic part end_cycle(false, ...) says it.
  ethercat::FrameOutcome on_timeout() noexcept { return main_.on_timeout(); }

  /// The cyclic part begins, once cyclic() is true: the first trigger.
  const CycleDecision& start(FreeRunningTime now) noexcept;
  /// At a trigger: the axes move, the frame of the cycle is written. `plant`: plant time now, for
  /// BusWrite::kTargetTime and kReadTime alone.
  [[nodiscard]] ethercat::ConstBytes begin_cycle(
      FreeRunningTime now, std::optional<ReferenceTime> plant = std::nullopt) noexcept;
  /// The frame of this cycle left at `sent` and came back (`answered`) at `received`, or did not;
  /// it is `now`. What follows for servo and drives; notes() are of this cycle.
  const CycleDecision& end_cycle(bool answered, const ethercat::FrameStamps& stamps,
                                 FreeRunningTime now) noexcept;
  /// All drives to SAFEOP; go on with next_frame() until stopped().
  void stop() noexcept { main_.stop(); }

  /// All SubDevices are in SAFEOP or OP, and frames leave at the triggers.
  [[nodiscard]] bool cyclic() const noexcept { return main_.cyclic(); }
  /// Nothing is left to be sent; main().failure() says why, if not on request.
  [[nodiscard]] bool stopped() const noexcept { return main_.stage() == ethercat::Stage::kStopped; }
  [[nodiscard]] const ethercat::MainDevice& main() const noexcept { return main_; }
  [[nodiscard]] const CycleServo& servo() const noexcept { return servo_; }
  /// How far the distributed clock is from plant time, in every mode.
  [[nodiscard]] const BusClockDecision& bus() const noexcept { return bus_.decision(); }
  /// How far each drive's clock is from the reference's.
  [[nodiscard]] const DriveClocks& clocks() const noexcept { return clocks_; }
  [[nodiscard]] const DriveAxes& axes() const noexcept { return axes_; }
  [[nodiscard]] const DriveSupervision& supervision() const noexcept { return supervision_; }
  [[nodiscard]] const CycleNodeConfig& config() const noexcept { return config_; }
  [[nodiscard]] const CycleDecision& decision() const noexcept { return decision_; }
  /// What the servo was told about the last cycle.
  [[nodiscard]] const CycleSample& sample() const noexcept { return sample_; }
  /// Of the last cycle; valid until the next begin_cycle().
  [[nodiscard]] std::span<const CycleNote> notes() const noexcept { return notes_.all(); }
  /// From the last frame's arrival at the reference to the SYNC0 that follows, ns in [0, cycle).
  [[nodiscard]] std::int64_t margin_ns() const noexcept;

 private:
  /// csp_objects() and 0x10F1:02.
  static constexpr std::size_t kObjects = 22;
  using Objects = std::array<ethercat::SdoDownload, kObjects>;
  [[nodiscard]] static Objects objects_for(const CycleNodeConfig& config) noexcept;
  [[nodiscard]] static ethercat::MainDeviceConfig main_config(const CycleNodeConfig& config,
                                                              const Objects& objects) noexcept;
  void write_time(FreeRunningTime now, ReferenceTime plant) noexcept;
  [[nodiscard]] std::optional<ReferenceTime> plant_at_reference(
      bool answered, const ethercat::FrameStamps& stamps) noexcept;
  void lead(ReferenceTime plant) noexcept;
  [[nodiscard]] bool settled() const noexcept;
  void watch_bus(bool answered, std::optional<ReferenceTime> plant) noexcept;

  CycleNodeConfig config_;
  Objects objects_;
  ethercat::MainDevice main_;
  CycleServo servo_;
  BusClock bus_;
  BridgeClock bridge_;
  DriveAxes axes_;
  DriveSupervision supervision_;
  DriveClocks clocks_;
  CycleDecision decision_;
  CycleSample sample_;
  CycleNotes notes_;
  std::int64_t bus_offset_ns_ = 0;  ///< in force when the next frame passes the reference
  bool offset_certain_ = true;      ///< the last frame came back
};

}  // namespace ftcs::node
