// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "ftcs/daemon/kept_state.h"
#include "ftcs/daemon/log.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/daemon/run_summary.h"
#include "ftcs/daemon/sample_report.h"
#include "ftcs/daemon/watch/watch_feed.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/node/clock_follower.h"
#include "ftcs/node/follower_event.h"

namespace ftcs::daemon {

/// What is remembered and said of a clock that follows: a line for each sample, summaries, notes as
/// log lines, what was learnt in the driftfile, the status for whoever asks. Decides nothing.
class FollowerRecord {
 public:
  /// State and discipline must outlive the record. `label` begins log lines: "port 1 (eth0)".
  FollowerRecord(const PtpOptions& options, Log& log, StateKeeper& state,
                 const ClockDiscipline& discipline, FreeRunningTime start, std::string label);

  /// Before the first sample.
  void begin();
  /// `sync_interval`: of the source, where it is known.
  void add(const node::Steered& steered, FreeRunningTime now,
           std::optional<Duration> sync_interval);
  /// Returns why the run must end, if it must.
  [[nodiscard]] std::optional<std::string> add(const node::Note& note);
  /// Once per turn of the loop.
  void follow_lock(FreeRunningTime now);
  /// At the end: the summary's lines; what was learnt goes to the driftfile.
  void log_summary();

  /// Who watches each sample; null: nobody.
  void set_watch(WatchFeed* feed) { watch_ = feed; }

  [[nodiscard]] bool locked() const { return discipline_.locked(); }
  /// Of all used samples since the first lock.
  [[nodiscard]] double offset_rms_ns() const { return summary_.offset_rms_ns(); }
  [[nodiscard]] const ClockDiscipline& discipline() const { return discipline_; }

  /// A message that did not steer, and why.
  struct Refusal {
    double time_s = 0.0;
    Direction direction = Direction::kForward;
    SampleVerdict verdict = SampleVerdict::kRejected;
    std::optional<double> offset_ns{};
  };
  /// What is known now, for whoever asks.
  struct Status {
    SampleRecord last{};  ///< the last Sync that was used
    bool has_sample = false;
    LocalTime last_local{};  ///< when it came, on the steered clock
    double last_age_s = 0.0;
    std::optional<double> locked_for_s{};  ///< none: not locked
    std::deque<Refusal> refusals{};        ///< the latest ones, oldest first
    std::string since_lock{};              ///< ptp4l's summary of all samples since the first lock
  };
  [[nodiscard]] Status status(FreeRunningTime now) const;
  /// ExitCode: kRuntimeError where samples could not be written, unless for want of a reader.
  [[nodiscard]] int exit_code() const;

 private:
  void watch_output();
  void tell_lost_samples();
  void add_sync(const node::Steered& steered, double time_s, std::optional<Duration> sync_interval);
  void report(const SampleRecord& record, std::optional<Duration> sync_interval);
  [[nodiscard]] bool has_room_for_line(double time_s);
  void report_text(const SampleRecord& record, std::optional<Duration> sync_interval);
  void keep_refusal(const node::Steered& steered, double time_s);
  [[nodiscard]] std::uint64_t samples_per_summary(std::optional<Duration> sync_interval) const;

  const PtpOptions& options_;
  Log& log_;
  bool output_failed_ = false;
  double line_room_ = 16.0;  ///< for lines of samples
  double line_room_at_s_ = 0.0;
  std::uint64_t lines_left_out_ = 0;
  std::uint64_t samples_lost_ = 0;
  std::uint64_t samples_lost_told_ = 0;
  platform::LineWriter samples_{stdout};  ///< as JSON or CSV
  StateKeeper& state_;
  const ClockDiscipline& discipline_;
  FreeRunningTime start_;
  std::string label_;
  RunSummary summary_;
  Status status_;
  FreeRunningTime last_used_{};
  WatchFeed* watch_ = nullptr;
  std::optional<FreeRunningTime> locked_since_{};
};

/// Where what the servo learns is kept, as the options say.
[[nodiscard]] StateKeeper state_keeper(const PtpOptions& options, Log& log, bool hardware_stamps);
/// The follower that the options ask for.
[[nodiscard]] node::ClockFollowerConfig follower_config(const PtpOptions& options,
                                                        bool hardware_stamps,
                                                        const std::optional<LearntState>& learnt);
/// What a driftfile is for: at the known rate from now on, long before the first message.
template <class Follower>
void start_at_known_rate(const StateKeeper& state, Follower& follower, Log& log,
                         const std::string& label) {
  if (!state.learnt()) return;
  const Rate rate = Rate::from_ratio(1.0 / (1.0 + state.learnt()->rate_deviation));
  if (follower.start_at(rate))
    log(LogLevel::kWarning, "{}: the clock refuses the driftfile's rate", label);
}

}  // namespace ftcs::daemon
