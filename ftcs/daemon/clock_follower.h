// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "ftcs/daemon/follower_record.h"

namespace ftcs::daemon {

/// A clock that follows pairs which somebody else's port has measured: a node::ClockFollower and
/// the record of what it does.
class ClockFollower {
 public:
  /// Clock and gate must outlive the follower. `label` begins log lines: "ptp4l".
  ClockFollower(const PtpOptions& options, Log& log, AdjustableClock& clock, FreeRunningTime start,
                bool hardware_stamps, const std::string& label,
                node::ReferenceGate* gate = nullptr);

  /// Returns why the run must end, if it must. `sync_interval`: of the source, where it is known.
  [[nodiscard]] std::optional<std::string> on_pair(const EventPair& pair, FreeRunningTime now,
                                                   std::optional<Duration> sync_interval);
  /// Peer to peer: one exchange beside the pairs. Returns as on_pair() does.
  [[nodiscard]] std::optional<std::string> on_link_delay(const ptp::EmitPeerDelay& measured,
                                                         FreeRunningTime now,
                                                         std::optional<Duration> sync_interval);
  void on_new_link() { node_.on_new_link(); }
  /// Once per turn of the loop.
  void on_silence();
  void on_new_reference() { node_.on_new_reference(); }
  void on_new_timescale() { node_.on_new_timescale(); }

  [[nodiscard]] bool locked() const { return node_.locked(); }
  [[nodiscard]] const ClockDiscipline& discipline() const { return node_.discipline(); }
  /// Before the first pair.
  void begin() { record_.begin(); }
  void set_watch(WatchFeed* feed) { record_.set_watch(feed); }
  [[nodiscard]] const FollowerRecord& record() const { return record_; }
  [[nodiscard]] FollowerRecord::Status status(FreeRunningTime now) const {
    return record_.status(now);
  }
  void log_summary() { record_.log_summary(); }

 private:
  [[nodiscard]] std::optional<std::string> take(FreeRunningTime now,
                                                std::optional<Duration> sync_interval);

  StateKeeper state_;
  node::ClockFollower node_;
  FollowerRecord record_;
};

}  // namespace ftcs::daemon
