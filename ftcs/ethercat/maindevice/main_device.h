// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/clock_setup.h"
#include "ftcs/ethercat/maindevice/configurator.h"
#include "ftcs/ethercat/maindevice/cyclic_exchange.h"
#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/reintegrator.h"
#include "ftcs/ethercat/maindevice/scanner.h"

namespace ftcs::ethercat {

/// How a segment is brought up, run and given up. Counts in a row must be above zero; nothing is
/// checked here. `clocks` and `process` say what is valid of theirs; spans in `process` are not
/// owned and must live as long as the MainDevice.
struct MainDeviceConfig {
  std::size_t expected_subdevices = 0;  ///< zero: any number
  bool scan_only = false;               ///< stop in INIT after scan and clock setup
  bool distributed_clocks = true;
  bool needs_reference = false;  ///< without a distributed clock the bring-up ends after the scan
  ClockSetupConfig clocks;
  ConfiguratorConfig process;
  std::uint32_t retries = 5;  ///< of one frame during the bring-up
  /// Consecutive cycles without a frame, or with a wrong working counter, before all SubDevices are
  /// sent to SAFEOP.
  std::uint32_t lost_frame_limit = 10;
  std::uint32_t working_counter_limit = 10;
  /// Consecutive cycles in which fewer SubDevices answer than were scanned (a wire is cut) before
  /// the rest is sent to SAFEOP. A restarted one still answers: it is brought back, see below.
  std::uint32_t absence_limit = 10;
  /// A SubDevice that answers and has lost its configuration is configured again while the others
  /// run; so often in a row at most.
  std::uint32_t reintegration_attempts = 3;
  Nanoseconds sii_timeout{1'000'000'000};
  /// For the whole of the bring-up: SubDevices that always have an answer and never the right one
  /// could keep it busy for ever.
  Nanoseconds bring_up_timeout{60'000'000'000};
  /// Reset SubDevices that are in OP, which another MainDevice drives, or that another works on.
  bool take_over = false;
  /// So long is looked, before anything is written, for another MainDevice that brings SubDevices
  /// up or runs them below OP. Zero: not at all, as in simulations.
  Nanoseconds listening{0};
  /// So long the way down is repeated until nobody is in OP any more.
  Nanoseconds stop_timeout{200'000'000};
};

/// Where the MainDevice is; stages are passed in this order. A failure of the cyclic stage, and
/// stop(), lead to the last two, a failure before it to the last.
enum class Stage : std::uint8_t {
  kScan,       ///< count, addresses, identity, SII, topology (Scanner)
  kClocks,     ///< delays, offsets, drift of the distributed clocks (ClockSetup)
  kConfigure,  ///< INIT to SAFEOP: mailboxes, objects, sync managers, FMMUs, SYNC0 (Configurator)
  kCyclic,     ///< frames leave at the cycle's instants; SAFEOP, or OP once it was asked for
  kStopping,   ///< everybody is being sent to SAFEOP
  kStopped,    ///< nothing more to send: failure() tells why, if not on request
};
[[nodiscard]] const char* name(Stage stage) noexcept;

/// When a frame went out and came back, on the MainDevice's clock.
struct FrameStamps {
  FreeRunningTime sent;
  FreeRunningTime received;
  /// What the system time of the segment shall be at `sent`, where it is not to be the
  /// MainDevice's own clock: plant time, on the epoch of distributed clocks.
  bool has_system_time = false;
  ReferenceTime system_time{};
};

/// What came of an answer, or of none.
enum class FrameOutcome : std::uint8_t {
  kIgnored,   ///< not the answer that was waited for: foreign, malformed, or late
  kProgress,  ///< ask for the next frame at once
  kCycle,     ///< a cycle is over; last_cycle() is new, unless its frame was lost
  kStopped,   ///< nothing more to send; failure() says why
};

/// Since construction; those "in a row" are what the limits of the configuration look at.
struct CycleCounters {
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;                   ///< not answered in time, in every stage
  std::uint64_t wrong_working_counter = 0;  ///< answered, and not by all: inputs are not new
  std::uint64_t ignored = 0;                ///< frames that were no answer
  std::uint32_t lost_in_a_row = 0;
  std::uint32_t wrong_in_a_row = 0;
  std::uint32_t absent_in_a_row = 0;  ///< cycles in which fewer answered than were scanned
  std::uint32_t reintegrated = 0;     ///< restarted SubDevices that are back
};

/// The EtherCAT MainDevice without a socket and without a clock: asks for frames to be sent and
/// takes what came back or did not. Before the cyclic stage the caller sends the next frame as soon
/// as the last is answered; in it, at each cycle's instant.
///
///     MainDevice main(config);                           // your link, frame and stamps
///     const auto exchange = [&] {
///       link.send(main.next_frame());
///       while (link.receive(frame, stamps, 10ms))        // what is ignored is not the answer
///         if (main.on_frame(frame, stamps) != FrameOutcome::kIgnored) return;
///       main.on_timeout();
///     };
///     while (!main.cyclic() && main.stage() != Stage::kStopped) exchange();
///     if (main.stage() == Stage::kStopped) return tell(main.failure());
///     main.request_operational();                        // once the cycle is in phase
///
/// Then, each cycle: write outputs(n), exchange, read inputs(n).
///
/// One frame is out at a time, with all that a cycle needs (CyclicExchange): the reference's system
/// time by FRMW of 0x0910, the process image by LRW, states and clock differences. The expected
/// working counter of the LRW is 2 for each SubDevice with outputs and 1 for each with inputs
/// (ETG.1000.4, 5.4); inputs count only where it is met.
///
/// Given up, by way of SAFEOP (AL control 0x0120 to all): lost_frame_limit, working_counter_limit,
/// absence_limit, a reintegration that fails again and again. During the bring-up the first error
/// stops at once. Standards: ETG.1000.4 (data link), .6 (states, CoE), ETG.1020 (clocks); what they
/// leave open: docs/spec-notes/ethercat.md.
///
/// Positions count from 0 in the order of the wire and must be below network().count, unchecked.
/// One thread; no heap; a fixed amount of work for each call.
class MainDevice {
 public:
  explicit MainDevice(const MainDeviceConfig& config) noexcept;

  /// The next frame (from the EtherCAT header on), valid until the next call. Empty when stopped. A
  /// frame that is still out counts as lost.
  [[nodiscard]] ConstBytes next_frame() noexcept;
  /// What came back, from the EtherCAT header on; the bytes are read in place. It is the answer if
  /// it has the number, commands, addresses and sizes of the frame that is out; else kIgnored, and
  /// the frame is still out.
  FrameOutcome on_frame(Bytes frame, const FrameStamps& stamps) noexcept;
  /// The frame that is out does not come back any more. During the bring-up the same is asked for
  /// again, `retries` times in a row.
  FrameOutcome on_timeout() noexcept;

  /// In the cyclic stage: ask all SubDevices for OP, one with each of the next frames. Who was
  /// restarted is asked by itself afterwards.
  void request_operational() noexcept;
  /// One step back to OP: an error is acknowledged (AL control SAFEOP with bit 4), and a SubDevice
  /// in SAFEOP without one is asked for OP. Nothing for any other; to be called again until it is
  /// there.
  void recover(std::size_t position) noexcept;
  /// All to SAFEOP, then nothing more: go on with next_frame() until it is empty. `reason`: what
  /// failure() shall say; kNone: on request.
  void stop(FailureKind reason = FailureKind::kNone) noexcept { begin_stop({.kind = reason}); }

  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  [[nodiscard]] bool cyclic() const noexcept { return stage_ == Stage::kCyclic; }
  /// What has gone wrong first, and whose fault it was.
  [[nodiscard]] const Failure& failure() const noexcept { return failure_; }
  /// What the scan has found, and each SubDevice's state as last read.
  [[nodiscard]] const Network& network() const noexcept { return network_; }
  /// Of the last frame that was answered: after a lost one it is that of the cycle before.
  [[nodiscard]] const CycleReport& last_cycle() const noexcept { return cycle_; }
  [[nodiscard]] const CycleCounters& counters() const noexcept { return counters_; }
  /// Position of the SubDevice that is being brought back at present; count(): none.
  [[nodiscard]] std::size_t reintegrating() const noexcept {
    return reintegrator_.active() ? reintegrator_.position() : network_.count;
  }
  /// After the way down: everybody who answers was seen out of OP.
  [[nodiscard]] bool stop_confirmed() const noexcept { return stop_confirmed_; }
  /// In the cyclic stage: all that were configured exchange process data.
  [[nodiscard]] bool complete() const noexcept;
  /// This one exchanges process data: it is in SAFEOP or OP, as far as is known.
  [[nodiscard]] bool takes_part(std::size_t position) const noexcept {
    return exchange_.takes_part(position);
  }
  /// CyclicExchange::set_reference_estimate().
  void set_reference_estimate(ReferenceTime estimate) noexcept {
    exchange_.set_reference_estimate(estimate);
  }
  /// In the cyclic stage: from the next frame on the reference's system time shows so much more
  /// (0x0920). Small steps alone: SYNC0 is running.
  void shift_system_time(std::int64_t by_ns) noexcept;
  /// CyclicExchange::write_system_time().
  void write_system_time(ReferenceTime time) noexcept { exchange_.write_system_time(time); }
  /// System time of the first SYNC0, ns; zero: there is none.
  [[nodiscard]] std::uint64_t sync0_start() const noexcept { return configurator_.sync0_start(); }

  /// The SubDevice's part of the process image, in the cyclic stage: outputs go with the next
  /// frame, inputs are those of the last cycle with the right working counter, or zero while it
  /// takes no part. Empty where it has none.
  [[nodiscard]] Bytes outputs(std::size_t position) noexcept {
    return exchange_.outputs(network_.devices[position]);
  }
  [[nodiscard]] ConstBytes inputs(std::size_t position) const noexcept {
    return exchange_.inputs(network_.devices[position]);
  }

 private:
  void write_frame(FrameWriter& writer) noexcept;
  [[nodiscard]] bool number_datagrams(ConstBytes frame) noexcept;
  [[nodiscard]] bool answers(const FrameView& frame) noexcept;
  FrameOutcome bring_up(const FrameView& frame, const FrameStamps& stamps) noexcept;
  FrameOutcome confirm_stop(const FrameView& frame, FreeRunningTime now) noexcept;
  FrameOutcome advance(Progress progress) noexcept;
  void write_reintegration(FrameWriter& writer) noexcept;
  void reintegrate(const FrameView& frame, FreeRunningTime now) noexcept;
  void keep_members() noexcept;
  FrameOutcome finish_cycle() noexcept;
  void begin_stop(const Failure& failure) noexcept;
  [[nodiscard]] bool clocks_wanted() const noexcept {
    return config_.distributed_clocks && network_.has_reference();
  }

  MainDeviceConfig config_;
  Stage stage_ = Stage::kScan;
  Failure failure_;
  Network network_;
  Scanner scanner_;
  ClockSetup clock_setup_;
  Configurator configurator_;
  CyclicExchange exchange_;
  Reintegrator reintegrator_;
  bool reintegrator_asked_ = false;  ///< it has datagrams in the frame that is out
  bool op_requested_ = false;
  std::uint32_t attempts_ = 0;
  std::size_t there_in_a_row_ = 0;  ///< cycles in which all answered
  CycleReport cycle_;
  CycleCounters counters_;

  std::array<std::uint8_t, kMaxFrameSize> buffer_{};
  std::size_t size_ = 0;  ///< of the frame that is out
  std::uint32_t number_ = 0;
  bool outstanding_ = false;
  FreeRunningTime begun_;  ///< first answer of the bring-up, of the way down
  bool has_begun_ = false;
  std::uint32_t retries_ = 0;
  std::uint32_t stop_frames_ = 0;
  bool stop_confirmed_ = false;
};

}  // namespace ftcs::ethercat
