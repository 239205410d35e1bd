// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "ftcs/daemon/ethercat/cycle_csv.h"
#include "ftcs/daemon/ethercat/plant_clock.h"
#include "ftcs/daemon/service_report.h"
#include "ftcs/experiment/cycle_figures.h"
#include "ftcs/node/cycle_node.h"
#include "ftcs/platform/ethercat_link.h"

namespace ftcs::daemon {

/// A run of `ftcs ethercat`: what the node needs, and what only a host does.
struct RunOptions {
  std::string interface;  ///< raw Ethernet; empty: UDP
  std::string host = "127.0.0.1";
  std::uint16_t port = ethercat::kUdpPort;
  std::size_t drives = 0;  ///< expected at least
  bool take_over = false;  ///< also SubDevices that are in OP
  std::string servo_name = "ftcs";
  CycleServoConfig servo;
  double sync0_phase = 0.5;  ///< SYNC0 comes this part of a cycle after the frame
  std::uint32_t drift_pulses = 15000;
  double duration_s = 10.0;  ///< of the cyclic part; zero: until a signal
  Nanoseconds spin{0};
  int priority = 80;
  int cpu = -1;
  /// 0x10F1:02: a missed SYNC0 window counts three, a good one takes one off. Lost frames of a
  /// shared line shall not fault the drives: six misses in a row do.
  std::uint32_t sync_error_limit = 17;
  /// Frames without an answer, in a row, before all drives are stopped.
  std::uint32_t lost_frame_limit = 10;
  /// So long the cycle may be without its lock, having had it, before all drives are stopped.
  double unlocked_limit_s = 10.0;
  node::LockPolicy lock_policy = node::LockPolicy::kRecovering;
  /// So long the first lock is waited for; zero: for ever.
  double await_lock_s = 0.0;
  /// So long fewer drives than scanned may answer before the rest is stopped.
  double ride_through_s = 0.0;
  bool move = true;          ///< the axes draw circles, two by two
  double radius = 10'000.0;  ///< counts
  double turn_s = 2.0;
  double start_s = 0.0;  ///< instant of plant time at which the circles begin; zero: at once
  node::BusMode bus_mode = node::BusMode::kFollow;
  node::BusWrite bus_write = node::BusWrite::kOffset;
  std::string plant_time;  ///< source (PlantClock); empty: none
  double bus_limit_ppm = 400.0;
  double bus_slope_ppm_s = 100.0;
  /// How often the fault of one axis is reset.
  std::uint32_t fault_resets = 0;
  bool contour = false;  ///< drives are the modelled ones: watch the circle of the first two
  bool quiet = false;
  bool trace = true;  ///< keep a point for each of the first half million cycles: histograms, plots
  std::string json;
  std::string csv;
  std::string html;
};

/// What the node is told for these options.
[[nodiscard]] node::CycleNodeConfig node_config(const RunOptions& options, bool scan_only);

/// Runs a CycleNode over a link: sleeps, sends, receives, writes figures and lines.
class MainRunner {
 public:
  MainRunner(const RunOptions& options, platform::EthercatLink link);
  /// The file of --csv, if there is one; before bring_up().
  [[nodiscard]] std::optional<WriteError> open_csv() {
    return options_.csv.empty() ? std::nullopt : csv_.open(options_.csv);
  }
  /// The clock of --plant-time; before bring_up().
  void set_plant_clock(PlantClock clock) { plant_.emplace(std::move(clock)); }
  /// The drives are put onto plant time before the first cycle: waits until it is known. One
  /// sentence if it is not within --await-lock (zero: half a minute), or `stop` came first.
  [[nodiscard]] std::optional<std::string> await_plant_time(const std::function<bool()>& stop);
  [[nodiscard]] const BusClockDecision& bus() const { return node_->bus(); }
  [[nodiscard]] std::optional<WriteError> finish_csv() { return csv_.finish(); }
  /// Until the cyclic stage. False: main().failure() tells why (or stopped by a signal).
  bool bring_up(const std::function<bool()>& stop, bool scan_only);
  /// The cyclic part.
  void run(const std::function<bool()>& stop);

  [[nodiscard]] const ethercat::MainDevice& main() const { return node_->main(); }
  [[nodiscard]] const experiment::CycleFigures& figures() const { return watch_.figures(); }
  [[nodiscard]] const CycleDecision& decision() const { return node_->decision(); }
  [[nodiscard]] const CycleServoCounters& servo_counters() const {
    return node_->servo().counters();
  }
  [[nodiscard]] const RunOptions& options() const { return options_; }

 private:
  /// Sends a frame and waits for its answer; false if none came until `deadline`.
  bool transfer(ethercat::ConstBytes frame, FreeRunningTime deadline);
  void exchange();
  void cycle();
  void stop_drives();
  void print_live() const;
  [[nodiscard]] std::optional<ReferenceTime> plant_now(FreeRunningTime now);
  [[nodiscard]] std::string_view service_sentence();

  RunOptions options_;
  platform::EthercatLink link_;
  std::unique_ptr<node::CycleNode> node_;
  experiment::CycleFigureWatch watch_;
  ethercat::FrameStamps stamps_;  ///< of the last frame
  FreeRunningTime next_line_;
  CycleCsv csv_;
  std::optional<PlantClock> plant_;
  ServiceReport service_;
  std::array<char, 160> sentence_{};  ///< the cyclic path touches no heap
};

}  // namespace ftcs::daemon
