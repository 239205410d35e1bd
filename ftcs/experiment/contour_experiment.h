// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/experiment/parallel.h"

namespace ftcs::experiment {

/// What the synchronisation of Section V means for motion: two modelled drives (counts of 1 um)
/// draw a circle in cyclic synchronous position, cycle 1 ms, SYNC0 half a cycle behind the frame.
/// The MainDevice's host wakes its task late (20 us and an exponential tail, cut at 200 us) and is
/// `reference_ppm` off the drives' reference clock, so that without a servo the frame wanders
/// through SYNC0.
struct ContourWorld {
  double radius_um = 25'000.0;
  double turn_s = 0.314;  ///< 0.5 m/s on the circle
  double reference_ppm = 50.0;
  double other_ppm = -80.0;
  double mean_lateness_us = 20.0;  ///< of the tail, above 20 us
  double settling_s = 4.0;         ///< lock, OP, enabling and the growing radius
  double measured_s = 40.0;        ///< two passages through SYNC0 at 50 ppm
};

/// One way to keep the cycle. Contour error: distance of the actual position from the circle that
/// the same position loops draw with no window missed.
struct ContourRow {
  std::string servo;
  double rms_um = 0.0;
  double max_um = 0.0;
  /// SYNC0 events of both drives without new outputs, 0x10F1:02 switched off so that they go on.
  std::uint64_t missed_windows = 0;
  std::uint64_t windows = 0;
  /// The same run with the drives' own limit: seconds until the first raises 0x001A; NaN: never.
  double first_fault_s = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t late_windows = 0;  ///< live only: of the missed ones, for want of the host
  std::string ended;               ///< live only: why it ended before its time; empty: it did not
  /// Largest of each group of kTraceGroup cycles, um.
  std::vector<double> trace_um;
  static constexpr int kTraceGroup = 20;
};

struct ContourResult {
  ContourWorld world;
  std::uint64_t seed = 1;
  std::vector<ContourRow> rows;  ///< no sync, PICS, FTCS, adaptive
};

[[nodiscard]] ContourRow run_contour(const ContourWorld& world, CycleLaw law, std::uint64_t seed);
[[nodiscard]] ContourResult run_contours(const ContourWorld& world, std::uint64_t seed,
                                         const JobControl& control);

}  // namespace ftcs::experiment
