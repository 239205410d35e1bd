// SPDX-License-Identifier: MIT
#include "ftcs/daemon/port_observer.h"

#include <algorithm>
#include <cmath>

namespace ftcs::daemon {
namespace {

// An announcement may be lost; the longest usual interval of Sync is two seconds.
constexpr double kShortestWindowS = 5.0;
constexpr double kAnnounceIntervals = 4.0;

std::uint64_t since(std::uint64_t now, std::uint64_t then) { return now - std::min(now, then); }

ptp::Counters since(const ptp::Counters& now, const ptp::Counters& then) {
  ptp::Counters counted;
  for (std::size_t i = 0; i < ptp::kCounters; ++i) {
    const auto counter = static_cast<ptp::Counter>(i);
    counted.add(counter, since(now[counter], then[counter]));
  }
  return counted;
}

DisciplineCounters since(const DisciplineCounters& now, const DisciplineCounters& then) {
  DisciplineCounters counted;
  counted.used = since(now.used, then.used);
  counted.rejected = since(now.rejected, then.rejected);
  counted.duplicate = since(now.duplicate, then.duplicate);
  counted.refused = since(now.refused, then.refused);
  counted.implausible = since(now.implausible, then.implausible);
  return counted;
}

}  // namespace

diagnosis::PortSettings port_settings(const PtpOptions& options) {
  diagnosis::PortSettings settings;
  settings.interface = options.interface;
  settings.way = static_cast<diagnosis::Way>(options.socket.transport);
  settings.group = options.socket.primary_mac;
  settings.domain = options.protocol.domain;
  settings.major_sdo_id = options.protocol.major_sdo_id;
  settings.peer_to_peer = options.protocol.peer_to_peer();
  const ptp::PeerDelayConfig peer = options.protocol.peer_delay_config();
  settings.capability_needed = peer.capability_needed;
  settings.lowest_peer_delay = peer.lowest;
  settings.highest_peer_delay = peer.highest;
  settings.unicast = options.socket.unicast.has_value();
  settings.steers =
      !options.follower.free_running && options.follower.servo.kind != ServoKind::kFreeRunning;
  settings.announce_interval_s = std::exp2(options.protocol.log_announce_interval);
  return settings;
}

diagnosis::PortSeen seen_of_link(const PtpOptions& options,
                                 const platform::PtpTransport& transport) {
  using diagnosis::Link;
  diagnosis::PortSeen seen;
  seen.settings = port_settings(options);
  const auto& closed = transport.closed();
  if (!closed) {
    seen.link = transport.is_up() && transport.has_carrier() ? Link::kUp : Link::kNoCarrier;
    return seen;
  }
  switch (closed->kind) {
    case platform::OsErrorKind::kInterfaceDown:
      seen.link = Link::kDown;
      break;
    case platform::OsErrorKind::kNoSuchInterface:
      seen.link = Link::kGone;
      break;
    case platform::OsErrorKind::kNoAddress:
      seen.link = Link::kNoAddress;
      break;
    default:
      seen.link = Link::kClosed;
      seen.closed = closed->message();
  }
  return seen;
}

PortObserver::PortObserver(const PtpOptions& options, const ptp::ClockIdentity& own,
                           FreeRunningTime start)
    : settings_(port_settings(options)),
      window_(Duration::from_ns(
          1e9 * std::max(kShortestWindowS,
                         kAnnounceIntervals * std::exp2(options.protocol.log_announce_interval)))) {
  older_.at = newer_.at = start;
  older_.talkers.set_own(own);
  newer_.talkers.set_own(own);
}

void PortObserver::on_message(std::span<const std::uint8_t> message) noexcept {
  older_.talkers.on_message(message, settings_.way);
  newer_.talkers.on_message(message, settings_.way);
}

void PortObserver::restart(FreeRunningTime now, const PortTotals& totals) {
  newer_.at = now;
  newer_.totals = totals;
  newer_.talkers.clear();
  older_ = newer_;
}

void PortObserver::turn(FreeRunningTime now, const PortTotals& totals) {
  if (now - newer_.at < window_) return;
  diagnosis::Talkers fresh = newer_.talkers;
  older_ = newer_;
  newer_ = {now, totals, {}};
  fresh.clear();
  newer_.talkers = fresh;
}

diagnosis::PortSeen PortObserver::seen(FreeRunningTime now, const PortTotals& totals) const {
  diagnosis::PortSeen seen;
  seen.settings = settings_;
  seen.seconds = (now - older_.at).seconds();
  seen.counters = since(totals.counters, older_.totals.counters);
  seen.at_port = older_.talkers;
  seen.receive_stamps_missing =
      since(totals.receive_stamps_missing, older_.totals.receive_stamps_missing);
  seen.unicast_dropped = since(totals.unicast_dropped, older_.totals.unicast_dropped);
  seen.foreign_changes = since(totals.foreign_changes, older_.totals.foreign_changes);
  seen.samples = since(totals.samples, older_.totals.samples);
  return seen;
}

}  // namespace ftcs::daemon
