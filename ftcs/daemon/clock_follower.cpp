// SPDX-License-Identifier: MIT
#include "ftcs/daemon/clock_follower.h"

namespace ftcs::daemon {

ClockFollower::ClockFollower(const PtpOptions& options, Log& log, AdjustableClock& clock,
                             FreeRunningTime start, bool hardware_stamps, const std::string& label,
                             node::ReferenceGate* gate)
    : state_(state_keeper(options, log, hardware_stamps)),
      node_(follower_config(options, hardware_stamps, state_.learnt()), clock, gate),
      record_(options, log, state_, node_.discipline(), start, label) {
  start_at_known_rate(state_, node_, log, label);
}

std::optional<std::string> ClockFollower::on_pair(const EventPair& pair, FreeRunningTime now,
                                                  std::optional<Duration> sync_interval) {
  node_.on_pair(pair, sync_interval);
  return take(now, sync_interval);
}

std::optional<std::string> ClockFollower::on_link_delay(const ptp::EmitPeerDelay& measured,
                                                        FreeRunningTime now,
                                                        std::optional<Duration> sync_interval) {
  node_.on_link_delay(measured, sync_interval);
  return take(now, sync_interval);
}

void ClockFollower::on_silence() {
  node_.on_silence();
  const FreeRunningTime now = discipline().latest().reading.free_running;
  (void)take(now, std::nullopt);  // a holdover ends no run
  record_.follow_lock(now);
}

// The first reason to end the run is the one that counts, and nothing is recorded after it.
std::optional<std::string> ClockFollower::take(FreeRunningTime now,
                                               std::optional<Duration> sync_interval) {
  std::optional<std::string> failure;
  while (const auto event = node_.next()) {
    if (failure) continue;
    if (const auto* note = std::get_if<node::Note>(&*event)) failure = record_.add(*note);
    if (const auto* steered = std::get_if<node::Steered>(&*event)) {
      record_.add(*steered, now, sync_interval);
    }
  }
  return failure;
}

}  // namespace ftcs::daemon
