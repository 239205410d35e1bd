// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ftcs/experiment/parallel.h"
#include "ftcs/node/cycle_node.h"

namespace ftcs::experiment {

/// Two machines of one plant: two hosts with their own crystals, four modelled drives on each, one
/// PTP grandmaster. A circle whose axes stand on different machines.
struct TwoMachinesWorld {
  static constexpr std::size_t kDrives = 4;
  Nanoseconds cycle{1'000'000};
  double crystal_ppm = 50.0;       ///< of every crystal: uniform within plus and minus
  double wander = 1e-9;            ///< random-walk FM of every crystal, per square root of a second
  double sync_interval_s = 0.125;  ///< of the grandmaster
  double stamp_tick_ns = 8.0;      ///< of the hardware stamps on the PTP side
  double cable_ns = 500.0;         ///< to the grandmaster, one way
  double frame_stamp_ns = 100.0;   ///< white noise of the host's stamps of its EtherCAT frames
  double mean_lateness_us = 20.0;  ///< exponential above 20 us, cut at 200 us
  double mean_stack_us = 3.0;      ///< from the clock's reading to the wire: exponential above 5 us
  node::BusWrite write = node::BusWrite::kOffset;
  double receiver_s = 8.0;  ///< PTP runs so long before the segment is switched on
  double settling_s = 30.0;
  double measured_s = 10.0;
  double radius_um = 25'000.0;
  double turn_s = 0.314;
};

enum class MachineMode : std::uint8_t {
  kNone,      ///< each cycle follows its own drives, no plant time
  kLead,      ///< bus shift
  kExternal,  ///< DCX
  kOne,       ///< both axes on one machine: what there is to reach
};
[[nodiscard]] const char* name(MachineMode mode) noexcept;

/// Where the drawn circle is off the one that was asked for.
struct CirclePoint {
  double angle_rad = 0.0;
  double error_um = 0.0;  ///< radial; positive: outside
};

/// True figures: SYNC0 of each drive of one machine against the same drive of the other.
struct TwoMachinesRun {
  bool up = false;
  double sync0_rms_ns = 0.0;
  double sync0_worst_ns = 0.0;
  double contour_rms_um = 0.0;
  double contour_worst_um = 0.0;
  std::uint64_t faults = 0;          ///< AL status codes that drives raised
  std::uint64_t missed_windows = 0;  ///< SYNC0 without new outputs, after OP
  double told_rms_ns = 0.0;          ///< error of dc_to_plant as the node tells it
  std::vector<CirclePoint> circle;   ///< the first turn that was measured
};

struct TwoMachinesRow {
  MachineMode mode = MachineMode::kNone;
  TwoMachinesRun median;  ///< of each figure over the seeds
  TwoMachinesRun worst;
  double demanded_rms_ns = 0.0;  ///< zero: nothing is demanded
  double demanded_worst_ns = 0.0;
  bool passed = false;
  std::vector<CirclePoint> circle;  ///< of the first seed, by angle
};

struct TwoMachinesResult {
  TwoMachinesWorld world;
  std::uint64_t seeds = 0;
  double kalman_rms_ns = 0.0;  ///< of a Kalman filter that knows all noises
  std::vector<TwoMachinesRow> rows;
  [[nodiscard]] bool passed() const noexcept;
};

[[nodiscard]] TwoMachinesRun run_two_machines(const TwoMachinesWorld& world, MachineMode mode,
                                              std::uint64_t seed);
/// RMS of SYNC0 against SYNC0 if each host estimated plant time, and the drives' clock against it,
/// with a Kalman filter that knows crystals and stamps, and moved the bus without delay.
[[nodiscard]] double kalman_sync0_rms_ns(const TwoMachinesWorld& world);
[[nodiscard]] TwoMachinesResult run_two_machines_table(const TwoMachinesWorld& world,
                                                       std::uint64_t seeds,
                                                       const JobControl& control);

}  // namespace ftcs::experiment
