// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "ftcs/daemon/service_report.h"
#include "ftcs/experiment/cycle_figures.h"
#include "ftcs/fieldbus/cycle_csv.h"
#include "ftcs/fieldbus/cycle_observer.h"
#include "ftcs/fieldbus/plant_clock.h"
#include "ftcs/fieldbus/run_options.h"
#include "ftcs/fieldbus/run_status.h"
#include "ftcs/node/cycle_node.h"
#include "ftcs/platform/ethercat_link.h"
#include "ftcs/platform/line_writer.h"

namespace ftcs::daemon {

/// What the node is told for these options.
[[nodiscard]] node::CycleNodeConfig node_config(const RunOptions& options, bool scan_only);

/// Runs a CycleNode over a link: sleeps, sends, receives, writes figures and lines. What time it is
/// the link's kernel says.
class MainRunner {
 public:
  MainRunner(const RunOptions& options, platform::EthercatLink link);
  /// The file of --csv, if there is one; before bring_up().
  [[nodiscard]] std::optional<WriteError> open_csv() {
    return options_.csv.empty() ? std::nullopt : csv_.open(options_.csv);
  }
  /// The clock of --plant-time; before bring_up().
  void set_plant_clock(PlantClock clock) { plant_.emplace(std::move(clock)); }
  /// Who is told once a second how it goes; must outlive the run.
  void tell(RunStatus& status) { status_ = &status; }
  /// The drives are put onto plant time before the first cycle: waits until it is known. One
  /// sentence if it is not within --await-lock (zero: half a minute), or `stop` came first.
  [[nodiscard]] std::optional<std::string> await_plant_time(const std::function<bool()>& stop);
  [[nodiscard]] const node::DriveClocks& clocks() const { return node_->clocks(); }
  [[nodiscard]] const BusClockDecision& bus() const { return node_->bus(); }
  [[nodiscard]] std::optional<WriteError> finish_csv() { return csv_.finish(); }
  /// Metrics and the live page, if they are wanted; before the process becomes one of real time.
  /// Returns what is wrong, or nothing.
  [[nodiscard]] std::optional<std::string> open_watch() { return observer_.open(); }
  [[nodiscard]] std::string watched_at() const { return observer_.where(); }
  /// To standard output, as far as somebody takes it: lines end no run, whatever becomes of them.
  void say(std::string_view lines);
  [[nodiscard]] diagnosis::CycleSeen seen() const { return observer_.seen(*node_, figures()); }
  /// "locked: ..." or "not locked: ...".
  [[nodiscard]] std::string_view sentence() { return service_sentence(); }
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
  void say_live();
  /// Of the clock that the link's stamps are of.
  [[nodiscard]] FreeRunningTime now() const noexcept { return link_.clock().now(); }
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
  RunStatus* status_ = nullptr;
  ServiceReport service_;
  CycleObserver observer_;
  platform::LineWriter lines_{stdout};
  bool output_failed_ = false;        ///< which has been said
  std::array<char, 480> sentence_{};  ///< the cyclic path touches no heap
};

}  // namespace ftcs::daemon
