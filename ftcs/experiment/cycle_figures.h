// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ftcs/analysis/quantile_sketch.h"
#include "ftcs/analysis/statistics.h"
#include "ftcs/discipline/lock_watch.h"
#include "ftcs/node/cycle_node.h"

namespace ftcs::experiment {

/// One judged cycle. Late is positive in `wire`, early in `phase`.
struct CyclePoint {
  float time_s = 0.0F;  ///< since the cyclic part began
  float phase_us = 0.0F;
  float wire_us = 0.0F;
  float lateness_us = 0.0F;
  float margin_us = 0.0F;
  float round_trip_us = 0.0F;
};

/// A note of the node and when it came.
struct CycleEvent {
  double time_s = 0.0;
  node::CycleNote note;
};

/// What the cycles of a node showed. Times in ns.
struct CycleFigures {
  std::uint64_t cycles = 0;
  std::uint64_t judged = 0;    ///< cycles within the gates after the lock: the figures below
  std::uint64_t excluded = 0;  ///< late or slow ones after the lock
  std::uint64_t working_counter_right = 0;
  std::uint64_t host_stalls = 0;   ///< cycles passed over
  std::uint64_t late_windows = 0;  ///< SYNC0 events that a wake-up was too late for, for each drive
  std::int64_t lock_cycle = -1;
  std::int64_t op_cycle = -1;
  LockWatch lock;  ///< how it came and went
  /// Bound of |0x092C|, from one second after the lock on; none: no such cycle was judged.
  std::optional<std::uint32_t> worst_difference_ns{};
  QuantileSketch lateness;
  QuantileSketch phase;
  QuantileSketch wire_phase;         ///< of the frame itself, lateness included
  QuantileSketch second_half_phase;  ///< of the run, locked or not
  QuantileSketch second_half_wire_phase;
  QuantileSketch round_trip;
  QuantileSketch margin;  ///< SYNC0 minus arrival
  std::vector<CyclePoint> trace;
  RunningStatistics contour;          ///< counts, off the circle that the drives' loops draw
  std::vector<double> contour_trace;  ///< largest of each 20 cycles
  std::vector<CycleEvent> events;     ///< the first thousand
};

struct CycleFiguresConfig {
  double duration_s = 0.0;  ///< of the cyclic part; zero: not known
  bool trace = true;        ///< keep a point for each of the first half million cycles
  bool contour = false;     ///< drives are the modelled ones: watch the circle of the first two
};

/// Makes figures of the cycles of one node. reserve() allocates; afterwards nothing does.
class CycleFigureWatch {
 public:
  explicit CycleFigureWatch(const CycleFiguresConfig& config) : config_(config) {}

  /// Before the first cycle, which begins at `start`.
  void reserve(const node::CycleNode& node, FreeRunningTime start);
  /// After each cycle.
  void note(const node::CycleNode& node, FreeRunningTime now);
  [[nodiscard]] const CycleFigures& figures() const noexcept { return figures_; }

 private:
  void judge(const node::CycleNode& node);
  void trace(const node::CycleNode& node);
  void watch_contour(const node::CycleNode& node);

  CycleFiguresConfig config_;
  CycleFigures figures_;
  FreeRunningTime start_;
  double contour_group_ = 0.0;
};

}  // namespace ftcs::experiment
