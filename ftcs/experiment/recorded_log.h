// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/record/line_reader.h"
#include "ftcs/time/result.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::experiment {

/// A message that was recorded, in free-running time.
struct RecordedPair {
  EventPair pair;
  /// Free-running clock minus reference in truth, ns, at the instant of pair.free_running, where
  /// the record tells.
  std::optional<double> truth_ns;
  /// What the recorded clock showed minus the free-running clock, ns: what its own servo had done.
  double steering_ns = 0.0;
};

/// A line that could not be used: shown, never guessed.
struct UnusableLine {
  std::size_t number = 0;
  std::string text;  ///< what was wrong, and the beginning of the line
};

/// A log as timestamp pairs between a reference and the clock as it would have run unsteered.
struct RecordedLog {
  std::string format;    ///< "ptp4l", "chrony tracking", "t1..t4" ...
  std::string source;    ///< of a log of linuxptp: "phc2sys CLOCK_REALTIME"
  bool two_way = false;  ///< pairs of both directions; else offsets, with the path delay taken out
                         ///< by who recorded them
  std::vector<RecordedPair> pairs;  ///< in the order of free-running time
  std::size_t lines = 0;
  std::size_t used = 0;
  std::size_t unusable = 0;
  std::vector<UnusableLine> examples;  ///< the first few of them
  std::vector<std::string> notes;      ///< how the record was understood
  double interval_s = 1.0;             ///< median time between forward messages
  bool has_truth = false;
  bool steered = false;  ///< the recorded clock was steered, and steering_ns tells how
};

/// Formats, told by their first lines; gzip or plain:
/// - ptp4l, phc2sys, ts2phc (linuxptp 2 to 4). X = free-running minus reference is rebuilt from the
/// offset o and the
///   applied frequency: X(i+1) - X(i) = o(i+1) - o(i) + f(i) dt, with o(i) = 0 after a step (s1).
///   s0 throughout = the clock was free-running already: X = o, and the frequency column is a
///   measurement, not added.
/// - chrony's tracking.log (X from offset and frequency) and measurements.log (offsets of the
/// steered clock).
/// - CSV with a heading: t1, t2, t3, t4 (t2 and t3 of the recorded clock), or time and offset;
/// truth
///   (recorded clock minus reference, at t2) if known. Units by the heading ("t1_s", "offset
///   (us)"); without one: offset, truth and t1..t4 are ns, time is s. A steered clock also has freq
///   (or rate): by how much it ran faster than its oscillator, from the last stamp of this line on,
///   ppb if the heading has no unit; or addend with nominal_addend, the register of an addend
///   clock: freq = addend / nominal_addend - 1. The free-running clock is then rebuilt: between two
///   lines it advanced by (local interval) / (1 + freq).
/// Truth between the instants at which the record tells it is interpolated, and unknown outside.
/// A log of several programs or clocks: `source` chooses one by name ("phc2sys CLOCK_REALTIME");
/// empty takes that with the most lines. The notes name the others.
[[nodiscard]] Result<RecordedLog, ReadError> read_recorded_log(const std::string& path,
                                                               const std::string& source = {});

}  // namespace ftcs::experiment
