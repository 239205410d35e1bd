// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ftcs/record/line_reader.h"
#include "ftcs/time/result.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

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

/// What a program said of all offsets since its line before.
struct RecordedSummary {
  double rms_ns = 0.0;
  double max_ns = 0.0;
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
  /// How the free-running clock was rebuilt, and what that cannot be trusted with.
  std::vector<std::string> replay_notes;
  /// Of a log that tells the state of its servo: the pair from which on it had locked; 0 also where
  /// it never did.
  std::size_t locked_from = 0;
  double interval_s = 1.0;  ///< median time between forward messages
  bool has_truth = false;
  bool timed = true;     ///< else the intervals are assumed
  bool steered = false;  ///< the recorded clock was steered, and steering_ns tells how
  /// Of a log that has nothing else: one for each pair, whose offset is not known.
  std::vector<RecordedSummary> summaries{};
};

class LogFormat;

/// Collects the lines of a log.
class LogReader {
 public:
  LogReader();
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// `number`: of the line in its file, from 1.
  void add(std::string_view line, std::size_t number);
  /// Once, after the last line: as read_recorded_log(), or what is wrong with the whole.
  [[nodiscard]] Result<RecordedLog, std::string> finish(const std::string& source);
  [[nodiscard]] bool empty() const noexcept { return log_.used == 0; }

 private:
  void leave_out(std::string_view line, std::size_t number, const std::string& why);

  std::unique_ptr<LogFormat> format_;
  RecordedLog log_;
};

/// Formats, told by their first lines; gzip or plain:
/// - ptp4l, phc2sys, ts2phc (linuxptp 2 to 4). X = free-running minus reference is rebuilt from the
/// offset o and the
///   applied frequency: X(i+1) - X(i) = o(i+1) - o(i) + f(i) dt, with o(i) = 0 after a step (s1).
///   s0 throughout = the clock was free-running already: X = o, and the frequency column is a
///   measurement, not added.
///   Where it wrote summaries alone (rms, max, freq), X is rebuilt from the frequency alone.
/// - chrony's tracking.log (X from offset and frequency); measurements.log, statistics.log and
///   refclocks.log (offsets of the steered clock, one source of several).
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

}  // namespace ftcs
