// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "apps/ftcs/kept_state.h"
#include "apps/ftcs/log.h"
#include "apps/ftcs/ptp_options.h"
#include "apps/ftcs/sample_report.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/measurement/link_delay.h"
#include "ftcs/measurement/shared_timescale.h"
#include "ftcs/ptp/actions.h"

namespace ftcs::app {

/// The half of a time receiver that stands behind the source of its timestamps: the discipline of
/// the steered clock, the record of each sample, lock and holdover, summaries.
class ClockFollower {
 public:
  /// The clock must outlive the follower. `label` begins log lines: "port 1 (eth0)".
  ClockFollower(const PtpOptions& options, Log& log, AdjustableClock& clock, FreeRunningTime start,
                bool hardware_stamps, std::string label);

  /// Returns why the run must end, if it must. `sync_interval`: of the source, where it is known.
  [[nodiscard]] std::optional<std::string> on_pair(const EventPair& pair, FreeRunningTime now,
                                                   std::optional<Duration> sync_interval);
  /// Peer to peer: one exchange beside the pairs, first of all the delay of the link. Until there
  /// is one, nothing is steered: the newest pair waits. With stamps, the neighbour is the
  /// transmitter: while they show the time of its Syncs the adaptive servo hears them too and
  /// estimates the path delay itself (decision 0015). Returns as on_pair() does.
  [[nodiscard]] std::optional<std::string> on_link_delay(const ptp::EmitPeerDelay& measured,
                                                         FreeRunningTime now,
                                                         std::optional<Duration> sync_interval);
  /// Another link: its delay is not known yet.
  void on_new_link();
  /// Once per turn of the loop.
  void on_silence();
  /// Another reference: what was learnt about the old one is void.
  void on_new_reference();
  /// The clock was put onto another timescale: begins anew, the bound of the first offset included.
  void on_new_timescale();
  /// At the end: the summary's lines; what was learnt goes to the driftfile.
  void log_summary();

  [[nodiscard]] bool locked() const { return discipline_.locked(); }
  /// Of all used samples since the first lock.
  [[nodiscard]] double offset_rms_ns() const { return since_lock_.offset_rms(); }
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

 private:
  struct Steered {
    Telemetry telemetry;
    LocalTime local{};                     ///< at the message's event
    Duration perceived{};                  ///< offset; of a forward message
    std::optional<std::string> failure{};  ///< why the run must end
  };
  [[nodiscard]] Steered steer(EventPair pair, FreeRunningTime now, bool paces = true);
  [[nodiscard]] std::optional<std::string> hear_stamps(const ptp::PeerStamps& stamps,
                                                       FreeRunningTime now);
  [[nodiscard]] std::optional<std::string> hear_response(FreeRunningTime before,
                                                         FreeRunningTime now);
  void follow_timescale(const EventPair& sync);
  void follow_verdict(SharedTimescale::Verdict before);
  void start_with_link_delay(const std::string& why);
  void forget_stamps();
  [[nodiscard]] bool is_another_link(Duration mean_link_delay) const;
  [[nodiscard]] bool shares_timescale() const {
    return timescale_.verdict() == SharedTimescale::Verdict::kShared;
  }
  [[nodiscard]] Duration delay_taken_off() const {
    return shares_timescale() ? start_delay_ : link_delay_.value();
  }
  [[nodiscard]] std::optional<std::string> report(const SampleRecord& record,
                                                  std::optional<Duration> sync_interval);
  void report_text(const SampleRecord& record, std::optional<Duration> sync_interval);
  void note_refusal(const Telemetry& telemetry, double time_s, std::optional<double> offset_ns);
  void follow_lock(FreeRunningTime now);
  [[nodiscard]] std::optional<std::string> on_clock_error(ClockError error);
  [[nodiscard]] std::uint64_t samples_per_summary(std::optional<Duration> sync_interval) const;

  const PtpOptions& options_;
  Log& log_;
  AdjustableClock& clock_;
  FreeRunningTime start_;
  std::string label_;
  StateKeeper state_;
  ClockDiscipline discipline_;
  LinkDelay link_delay_;
  SharedTimescale timescale_;  ///< of the neighbour's stamps
  /// Heard with the next Sync: of the two the one whose event came first.
  std::optional<EventPair> response_{};
  int unstamped_exchanges_ = 0;  ///< since the last Sync
  int syncs_without_stamps_ = 0;
  Duration start_delay_{};  ///< the link's when the servo began to estimate what it differs by
  std::optional<EventPair> waiting_{};  ///< for the first link delay
  SampleSummary recent_;
  SampleSummary since_lock_;
  bool in_holdover_ = false;
  std::uint32_t refused_syncs_ = 0;  ///< in a row
  bool clock_refuses_ = false;
  Status status_;
  FreeRunningTime last_used_{};
  std::optional<FreeRunningTime> locked_since_{};
};

}  // namespace ftcs::app
