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
  /// Reset SubDevices that are in OP, which another MainDevice drives.
  bool take_over = false;
  /// So long the way down is repeated until nobody is in OP any more.
  Nanoseconds stop_timeout{200'000'000};
};

enum class Stage : std::uint8_t {
  kScan,
  kClocks,
  kConfigure,
  kCyclic,    ///< frames leave at the cycle's instants; SAFEOP, or OP once it was asked for
  kStopping,  ///< everybody is being sent to SAFEOP
  kStopped,   ///< nothing more to send: failure() tells why, if not on request
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

enum class FrameOutcome : std::uint8_t {
  kIgnored,   ///< not the answer that was waited for: foreign, malformed, or late
  kProgress,  ///< ask for the next frame at once
  kCycle,     ///< last_cycle() is new
  kStopped,
};

struct CycleCounters {
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;
  std::uint64_t wrong_working_counter = 0;
  std::uint64_t ignored = 0;
  std::uint32_t lost_in_a_row = 0;
  std::uint32_t wrong_in_a_row = 0;
  std::uint32_t absent_in_a_row = 0;  ///< cycles in which fewer answered than were scanned
  std::uint32_t reintegrated = 0;     ///< restarted SubDevices that are back
};

/// The EtherCAT MainDevice without a socket and without a clock: asks for frames to be sent and
/// takes what came back or did not. Before the cyclic stage the caller sends the next frame as soon
/// as the last is answered; in it, at each cycle's instant.
class MainDevice {
 public:
  explicit MainDevice(const MainDeviceConfig& config) noexcept;

  /// The next frame (from the EtherCAT header on), valid until the next call. Empty when stopped. A
  /// frame that is still out counts as lost.
  [[nodiscard]] ConstBytes next_frame() noexcept;
  /// What came back; the bytes are read in place.
  FrameOutcome on_frame(Bytes frame, const FrameStamps& stamps) noexcept;
  FrameOutcome on_timeout() noexcept;

  /// In the cyclic stage: ask all SubDevices for OP.
  void request_operational() noexcept;
  /// Acknowledge the error of one SubDevice and bring it back to what the others are in.
  void recover(std::size_t position) noexcept;
  /// All to SAFEOP, then nothing more.
  void stop(FailureKind reason = FailureKind::kNone) noexcept { begin_stop({.kind = reason}); }

  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  [[nodiscard]] bool cyclic() const noexcept { return stage_ == Stage::kCyclic; }
  [[nodiscard]] const Failure& failure() const noexcept { return failure_; }
  [[nodiscard]] const Network& network() const noexcept { return network_; }
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
  /// System time of the first SYNC0.
  [[nodiscard]] std::uint64_t sync0_start() const noexcept { return configurator_.sync0_start(); }

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
