// SPDX-License-Identifier: MIT
#include "apps/ftcs/ptp_receiver.h"

#include <cmath>
#include <utility>
#include <variant>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/status_report.h"

namespace ftcs::app {
namespace {

ptp::TimeReceiverConfig core_config(const PtpOptions& options, const ptp::PortIdentity& identity,
                                    std::uint64_t seed) {
  ptp::TimeReceiverConfig config;
  config.port = identity;
  config.domain = options.domain;
  config.major_sdo_id = options.major_sdo_id;
  config.minor_version = options.minor_version;
  config.log_announce_interval = options.log_announce_interval;
  config.announce_receipt_timeout = options.announce_receipt_timeout;
  config.log_min_delay_req_interval = options.log_min_delay_req_interval;
  config.unicast = options.socket.unicast.has_value();
  config.hybrid = options.hybrid;
  config.delay_mechanism = options.delay_mechanism;
  config.peer_delay = options.peer_delay_config();
  config.assume_two_step = options.assume_two_step;
  config.sync_receipt_timeout = options.sync_receipt_timeout;
  config.acceptable = options.acceptable;
  config.fast_start = options.fast_start;
  config.delay_asymmetry = options.delay_asymmetry;
  config.seed = seed;
  return config;
}

}  // namespace

PtpReceiver::PtpReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                         std::unique_ptr<platform::TimestampClock> timestamps,
                         const PortFacts& facts, RealClock* real_clock)
    : PtpCorePort(kernel, options, log, std::move(timestamps),
                  core_config(options, facts.identity,
                              static_cast<std::uint64_t>(kernel.clock_ns(CLOCK_MONOTONIC_RAW))),
                  real_clock),
      follower_(this->options(), log, clock(), now(), has_hardware_stamps(),
                "port 1 (" + options.interface + ")"),
      facts_(facts) {}

ptp::ActionList PtpReceiver::start(FreeRunningTime now) {
  if (options().output == Output::kCsv) fmt::print("{}\n", csv_header());
  return PtpCorePort::start(now);
}

void PtpReceiver::act(const ptp::Action& action) {
  if (const auto* emitted = std::get_if<ptp::EmitPair>(&action)) {
    on_pair(emitted->pair);
  } else if (const auto* delay = std::get_if<ptp::EmitPeerDelay>(&action)) {
    follow_scale_change();
    ptp::EmitPeerDelay measured = *delay;  // the delay is one, whatever its stamps say of time
    if (measured.stamps && !admits(measured.stamps->request)) measured.stamps.reset();
    if (const auto wrong = follower_.on_link_delay(measured, now(), core().sync_interval())) {
      return fail(*wrong);
    }
  } else if (const auto* change = std::get_if<ptp::PortStateChanged>(&action)) {
    if (change->to == ptp::PortState::kFaulty) follower_.on_new_link();
  } else if (const auto* seen = std::get_if<ptp::TransmitterSeen>(&action)) {
    log()(LogLevel::kNotice, "port 1 ({}): new foreign master {}", options().interface,
          to_text(seen->port).view());
  } else if (const auto* selected = std::get_if<ptp::TransmitterSelected>(&action)) {
    on_selected(*selected);
  } else if (const auto* jumped = std::get_if<ptp::ReferenceJumped>(&action)) {
    log()(LogLevel::kWarning, "port 1 ({}): the reference jumped by {:.9f} s; starting anew",
          options().interface, jumped->jump.seconds());
    follower_.on_new_reference();
  }
}

void PtpReceiver::on_selected(const ptp::TransmitterSelected& selected) {
  set_scale(reference_scale(selected.transmitter.flags, selected.transmitter.announce.utc_offset));
  if (!selected.changed) return;
  log()(LogLevel::kNotice, "selected best master clock {}",
        to_text(selected.transmitter.announce.grandmaster).view());
  if ((selected.transmitter.flags & ptp::flag::kPtpTimescale) == 0) {
    log()(LogLevel::kNotice, "foreign master not using PTP timescale");
  }
  if (had_transmitter_) follower_.on_new_reference();
  had_transmitter_ = true;
}

void PtpReceiver::on_pair(const EventPair& pair) {
  follow_scale_change();
  if (!admits(pair)) return;
  if (const auto wrong = follower_.on_pair(pair, now(), core().sync_interval())) {
    return fail(*wrong);
  }
  follow_lock(follower_.locked());
  feed_others(follower_);
}

// From the port's state and not from a change of the lock: after a fault shorter than the lock's
// patience the port comes back uncalibrated while the clock has been locked all along. After a
// longer one it has not: that is told in every state.
void PtpReceiver::follow_lock(bool locked) {
  if (locked && core().state() == ptp::PortState::kUncalibrated) {
    perform(core().on_servo_locked(now()));
  } else if (!locked) {
    perform(core().on_servo_unlocked(now()));
  }
}

void PtpReceiver::housekeeping(FreeRunningTime) {
  follower_.on_silence();
  if (real_clock() != nullptr) {
    const ClockDiscipline& discipline = follower_.discipline();
    if (const auto wrong = real_clock()->attend(discipline.counters().commands > 0,
                                                discipline.locked(), discipline.latest().servo)) {
      return fail(*wrong);
    }
    follow_scale_change();
  }
  if (!follower_.locked()) follow_lock(false);  // only a sample can say that it is locked again
  // Whoever runs for days must not wait for the end to learn this.
  constexpr double kPatienceInAnnounces = 5.0;
  if (!looked_for_missing_ &&
      seconds_since_start() > kPatienceInAnnounces * std::exp2(options().log_announce_interval)) {
    looked_for_missing_ = true;
    if (log_missing(LogLevel::kWarning)) log_unusual(core().counters());
  }
}

// Before the next sample, which would be seconds off. The clock is never stepped for it.
void PtpReceiver::follow_scale_change() {
  if (real_clock() != nullptr && real_clock()->take_scale_change()) follower_.on_new_reference();
}

bool PtpReceiver::log_missing(LogLevel level) {
  if (!had_transmitter_) {
    log()(level, "no time transmitter was found: domain {}, {}, transportSpecific {}",
          options().domain, platform::name(options().socket.transport), options().major_sdo_id);
  }
  const bool no_peer = options().peer_to_peer() && !core().peer_delay().mean_link_delay();
  if (no_peer) {
    log()(level, "no peer delay: the neighbour answers no Pdelay_Req (-E needs none)");
  }
  return !had_transmitter_ || no_peer;
}

int PtpReceiver::finish() {
  follower_.log_summary();
  (void)log_missing(LogLevel::kNotice);
  log_peer_delay(core().peer_delay());
  log_unusual(core().counters());
  return follower_.locked() ? kSuccess : kNotLocked;
}

ptp::ManagedPort PtpReceiver::managed_port() {
  return data_sets(options(), facts_, core(), follower_, now());
}

std::string PtpReceiver::status(const ptp::ManagementCounters& management) {
  const StatusOfPort port{options(), facts_, seconds_since_start(), management};
  return receiver_status(port, core(), follower_, now());
}

}  // namespace ftcs::app
