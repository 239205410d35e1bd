// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/ftcs/ethercat/cycle_csv.h"
#include "ftcs/analysis/quantile_sketch.h"
#include "ftcs/analysis/statistics.h"
#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/discipline/lock_watch.h"
#include "ftcs/ethercat/maindevice/circle_path.h"
#include "ftcs/ethercat/maindevice/csp_axis.h"
#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/platform/ethercat_link.h"
#include "ftcs/report/json.h"

namespace ftcs::app {

struct RunOptions {
  std::string interface;  ///< raw Ethernet; empty: UDP
  std::string host = "127.0.0.1";
  std::uint16_t port = ethercat::kUdpPort;
  std::size_t drives = 0;  ///< expected at least
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
  /// So long fewer drives than scanned may answer before the rest is stopped.
  double ride_through_s = 0.0;
  bool move = true;          ///< the axes draw circles, two by two
  double radius = 10'000.0;  ///< counts
  double turn_s = 2.0;
  bool contour = false;  ///< drives are the modelled ones: watch the circle of the first two
  bool quiet = false;
  bool trace = true;  ///< keep a point for each of the first half million cycles: histograms, plots
  std::string json;
  std::string csv;
  std::string html;
};

/// One judged cycle. Late is positive in `wire`, early in `phase`.
struct RunPoint {
  float time_s = 0.0F;  ///< since the cyclic part began
  float phase_us = 0.0F;
  float wire_us = 0.0F;
  float lateness_us = 0.0F;
  float margin_us = 0.0F;
  float round_trip_us = 0.0F;
};

/// Something that happened while the drives ran.
struct RunEvent {
  enum class Kind : std::uint8_t {
    kLocked,
    kLockLost,
    kLeftOp,        ///< with its AL status code
    kOutOfReach,    ///< does not answer to its address
    kReintegrated,  ///< was restarted, has its configuration back
    kBackInOp,
  };
  static constexpr std::uint16_t kNobody = 0xFFFF;
  double time_s = 0.0;
  Kind kind = Kind::kLocked;
  std::uint16_t drive = kNobody;
  ethercat::AlStatusCode code = ethercat::AlStatusCode::kNoError;
};

/// What a run showed. Times in ns.
struct RunFigures {
  std::uint64_t cycles = 0;
  std::uint64_t judged = 0;    ///< cycles within the gates after the lock: the figures below
  std::uint64_t excluded = 0;  ///< late or slow ones after the lock
  std::uint64_t working_counter_right = 0;
  std::uint64_t host_stalls = 0;   ///< cycles passed over
  std::uint64_t late_windows = 0;  ///< SYNC0 events that a wake-up was too late for, for each drive
  std::int64_t lock_cycle = -1;
  std::int64_t op_cycle = -1;
  LockWatch lock;                         ///< how it came and went
  std::uint32_t worst_difference_ns = 0;  ///< bound of |0x092C|, from one second after the lock on
  QuantileSketch lateness;
  QuantileSketch phase;
  QuantileSketch wire_phase;         ///< of the frame itself, lateness included
  QuantileSketch second_half_phase;  ///< of the run, locked or not
  QuantileSketch second_half_wire_phase;
  QuantileSketch round_trip;
  QuantileSketch margin;  ///< SYNC0 minus arrival
  std::vector<RunPoint> trace;
  RunningStatistics contour;          ///< counts, off the circle that the drives' loops draw
  std::vector<double> contour_trace;  ///< largest of each 20 cycles
  std::vector<RunEvent> events;       ///< the first thousand
};

/// Drives a MainDevice and a cycle servo over a link: bring-up, cyclic exchange, motion, report.
class MainRunner {
 public:
  MainRunner(const RunOptions& options, platform::EthercatLink link);
  /// The file of --csv, if there is one; before bring_up().
  [[nodiscard]] std::optional<WriteError> open_csv() {
    return options_.csv.empty() ? std::nullopt : csv_.open(options_.csv);
  }
  [[nodiscard]] std::optional<WriteError> finish_csv() { return csv_.finish(); }
  /// Until the cyclic stage. False: main().failure() tells why (or stopped by a signal).
  bool bring_up(const std::function<bool()>& stop, bool scan_only);
  /// The cyclic part.
  void run(const std::function<bool()>& stop);

  [[nodiscard]] const ethercat::MainDevice& main() const { return *main_; }
  [[nodiscard]] const RunFigures& figures() const { return figures_; }
  [[nodiscard]] const CycleDecision& decision() const { return decision_; }
  [[nodiscard]] const CycleServoCounters& servo_counters() const { return servo_->counters(); }
  [[nodiscard]] const RunOptions& options() const { return options_; }
  [[nodiscard]] const std::vector<ethercat::CspAxis>& axes() const { return axes_; }

 private:
  /// One frame there and back; false if none came.
  void reserve_trace();
  bool exchange(FreeRunningTime deadline, CycleSample* sample);
  void cycle();
  void move_axes();
  void note(const CycleSample& sample, bool answered);
  void trace(const CycleSample& sample);
  void supervise();
  void stop_drives();
  void watch_lock();
  void watch_drives();
  void watch_contour();
  void record(RunEvent::Kind kind, std::size_t drive = RunEvent::kNobody,
              ethercat::AlStatusCode code = ethercat::AlStatusCode::kNoError);
  void print_live() const;
  [[nodiscard]] std::int64_t margin_ns(const CycleSample& sample) const;

  RunOptions options_;
  platform::EthercatLink link_;
  std::unique_ptr<ethercat::MainDevice> main_;
  std::unique_ptr<CycleServo> servo_;
  std::vector<ethercat::SdoDownload> objects_;
  std::vector<ethercat::CspAxis> axes_;
  ethercat::CirclePath path_;
  /// What was last recorded of a drive.
  enum class Seen : std::uint8_t { kNotYet, kInOp, kLeftOp, kOutOfReach };
  std::vector<Seen> seen_;
  std::uint64_t unlocked_limit_ = 0;  ///< cycles
  std::uint32_t reintegrated_ = 0;
  std::size_t reintegrating_ = 0;
  double contour_group_ = 0.0;
  CycleDecision decision_;
  RunFigures figures_;
  FreeRunningTime start_;
  FreeRunningTime next_line_;
  std::uint64_t asked_at_ = 0;  ///< cycle in which OP was asked for
  CycleCsv csv_;
};

[[nodiscard]] const char* name(CycleState state);
[[nodiscard]] const char* name(RunEvent::Kind kind);
void print_scan(const ethercat::MainDevice& main);
/// One or two lines for the user: what failed, where, and what was expected.
[[nodiscard]] std::string describe(const ethercat::Failure& failure);
void print_run(const MainRunner& runner);
[[nodiscard]] Json run_json(const MainRunner& runner);

}  // namespace ftcs::app
