// SPDX-License-Identifier: MIT
#include "ftcs/daemon/ptp_receiver.h"

#include <cmath>
#include <utility>
#include <variant>

#include "ftcs/daemon/port_config.h"
#include "ftcs/daemon/status_report.h"
#include "ftcs/daemon/watch/follower_watch.h"
#include "ftcs/ptp/random.h"

namespace ftcs::daemon {

node::ReceiverNodeConfig receiver_node_config(const PtpOptions& options, const PortFacts& facts,
                                              const std::optional<LearntState>& learnt,
                                              std::uint64_t seed) {
  node::ReceiverNodeConfig node;
  node.follower = follower_config(options, facts.hardware_stamps, learnt);
  ptp::TimeReceiverConfig& config = node.port;
  config = port_config<ptp::TimeReceiverConfig>(options, facts.identity);
  config.announce_receipt_timeout = options.receiver.announce_receipt_timeout;
  config.hybrid = options.receiver.hybrid;
  config.sync_receipt_timeout = options.receiver.sync_receipt_timeout;
  config.acceptable = options.receiver.acceptable;
  config.fast_start = options.receiver.fast_start;
  config.delay_asymmetry = options.receiver.delay_asymmetry;
  config.seed = seed;
  config.first_request_id = static_cast<std::uint16_t>(0x1p16 * ptp::Random(seed).uniform());
  config.peer_delay.first_request_id = config.first_request_id;
  return node;
}

PtpReceiver::PtpReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                         std::unique_ptr<platform::TimestampClock> timestamps,
                         const PortFacts& facts, RealClock* real_clock)
    : PtpPort(kernel, options, log, std::move(timestamps), real_clock),
      state_(state_keeper(this->options(), log, facts.hardware_stamps)),
      node_(receiver_node_config(this->options(), facts, state_.learnt(),
                                 static_cast<std::uint64_t>(kernel.clock_ns(CLOCK_MONOTONIC_RAW))),
            clock(), gate()),
      record_(this->options(), log, state_, node_.discipline(), now(),
              "port 1 (" + options.interface + ")"),
      observer_(this->options(), facts.identity.clock, now()),
      facts_(facts) {
  start_at_known_rate(state_, node_, log, "port 1 (" + options.interface + ")");
}

void PtpReceiver::start(FreeRunningTime now) {
  record_.begin();
  record_.set_watch(watch());
  node_.start(now);
  take_events(now);
}

void PtpReceiver::on_event(std::span<const std::uint8_t> bytes, FreeRunningTime received,
                           FreeRunningTime now) {
  observer_.on_message(bytes);
  node_.on_event_message(bytes, received, now);
  take_events(now);
}

void PtpReceiver::on_general(std::span<const std::uint8_t> bytes, FreeRunningTime now) {
  observer_.on_message(bytes);
  node_.on_general_message(bytes, now);
  take_events(now);
}

void PtpReceiver::on_sent(const ptp::EventId& id, std::optional<FreeRunningTime> sent,
                          FreeRunningTime now) {
  if (sent) {
    node_.on_transmit_timestamp(id, *sent, now);
  } else {
    node_.on_transmit_timestamp_missing(id, now);
  }
  take_events(now);
}

void PtpReceiver::on_timer(FreeRunningTime now) {
  node_.on_timer(now);
  take_events(now);
}

void PtpReceiver::on_link_change(bool up, FreeRunningTime now) {
  if (up) {
    observer_.restart(now, totals());
    node_.on_link_up(now);
  } else {
    node_.on_link_down(now);
  }
  take_events(now);
}

void PtpReceiver::take_events(FreeRunningTime now) {
  while (const auto event = node_.next()) take(*event, now);
}

void PtpReceiver::take(const node::ReceiverEvent& event, FreeRunningTime now) {
  if (const auto* action = std::get_if<ptp::Action>(&event)) {
    perform(*action);
    tell(*action);
  } else if (has_failed()) {
    return;  // nothing is recorded after it
  } else if (const auto* note = std::get_if<node::Note>(&event)) {
    if (const auto wrong = record_.add(*note)) fail(*wrong);
  } else if (const auto* steered = std::get_if<node::Steered>(&event)) {
    record_.add(*steered, now, node_.port().sync_interval());
    if (steered->paces) feed_others(record_);
  }
}

void PtpReceiver::tell(const ptp::Action& action) {
  if (const auto* seen = std::get_if<ptp::TransmitterSeen>(&action)) {
    log()(LogLevel::kNotice, "port 1 ({}): new foreign master {}", options().interface,
          to_text(seen->port).view());
  } else if (const auto* selected = std::get_if<ptp::TransmitterSelected>(&action)) {
    on_selected(*selected);
  } else if (const auto* doubted = std::get_if<ptp::TransmitterDoubted>(&action)) {
    log()(LogLevel::kWarning,
          "port 1 ({}): transmitter {} tells another time than ours: any other is preferred",
          options().interface, to_text(doubted->port).view());
  }
}

void PtpReceiver::on_selected(const ptp::TransmitterSelected& selected) {
  set_scale(reference_scale(selected.transmitter.flags, selected.transmitter.announce.utc_offset));
  follow_scale_change();
  if (!selected.changed) return;
  log()(LogLevel::kNotice, "selected best master clock {}",
        to_text(selected.transmitter.announce.grandmaster).view());
  if ((selected.transmitter.flags & ptp::flag::kPtpTimescale) == 0) {
    log()(LogLevel::kNotice, "foreign master not using PTP timescale");
  }
}

void PtpReceiver::housekeeping(FreeRunningTime now) {
  node_.on_silence(now);
  take_events(now);
  record_.follow_lock(now);
  publish_time(time_bound(node_.discipline().latest(), node_.discipline().samples()));
  observer_.turn(now, totals());
  service().turn(now, node_.locked(), [this] { return service_sentence(); });
  publish(now, [this] { return watched(); });
  if (real_clock() != nullptr) {
    const ClockDiscipline& discipline = node_.discipline();
    if (const auto wrong = real_clock()->attend(discipline.counters().commands > 0,
                                                discipline.locked(), discipline.latest().servo)) {
      return fail(*wrong);
    }
    follow_scale_change();
  }
  // Whoever runs for days must not wait for the end to learn this.
  constexpr double kPatienceInAnnounces = 5.0;
  constexpr double kLeastPatienceS = 2.5;  // before, a diagnosis blames nobody
  if (!looked_for_missing_ &&
      seconds_since_start() >
          std::fmax(kLeastPatienceS,
                    kPatienceInAnnounces * std::exp2(options().protocol.log_announce_interval))) {
    looked_for_missing_ = true;
    if (node_.locked() || node_.discipline().path_delay_known()) return;
    log_findings(LogLevel::kWarning);
    log_unusual(node_.port().counters());
  }
}

std::string PtpReceiver::service_sentence() {
  return diagnosis::sentence(diagnosis::diagnose(seen()));
}

PortTotals PtpReceiver::totals() {
  PortTotals totals;
  totals.counters = node_.port().counters();
  if (const platform::PtpSocket* socket = transport().socket()) {
    totals.receive_stamps_missing = socket->counters().receive_stamp_missing;
    totals.unicast_dropped = socket->counters().unicast_dropped;
  }
  totals.foreign_changes = timestamps().foreign_steps();
  if (real_clock() != nullptr) totals.foreign_changes += real_clock()->clock().foreign_rates();
  totals.samples = node_.discipline().counters();
  return totals;
}

diagnosis::PortSeen PtpReceiver::seen(FreeRunningTime now) {
  diagnosis::PortSeen seen = observer_.seen(now, totals());
  const diagnosis::PortSeen link = seen_of_link();
  // Whoever is heard is there, whatever the interface says of its carrier.
  const bool is_heard = transport().is_up() && !seen.at_port.all().empty();
  seen.link = is_heard ? diagnosis::Link::kUp : link.link;
  seen.closed = link.closed;
  seen.has_transmitter = node_.port().transmitter() != nullptr;
  seen.peer_delay = node_.port().peer_delay().mean_link_delay();
  seen.locked = node_.locked();
  seen.path_delay_known = node_.discipline().path_delay_known();
  seen.servo = node_.discipline().latest().servo;
  seen.rate = node_.discipline().latest().tracking_rate;
  if (real_clock() != nullptr) {
    seen.refusal = real_clock()->refusal().value_or("");
    seen.clock = real_clock()->name();
  }
  return seen;
}

WatchState PtpReceiver::watched() {
  WatchState state = watch_state(node_.discipline(), servo_kind_name(options().follower.servo.kind),
                                 diagnosis::diagnose(seen()));
  if (const ptp::TransmitterData* transmitter = node_.port().transmitter()) {
    state.reference.set(to_text(transmitter->announce.grandmaster).view());
  }
  if (options().protocol.security) {
    using ptp::Counter;
    const ptp::Counters& count = node_.port().counters();
    state.messages = {.present = true,
                      .authentic = count[Counter::kAuthenticated],
                      .missing = count[Counter::kAuthenticationMissing],
                      .unknown_key = count[Counter::kAuthenticationUnknownKey],
                      .wrong_code = count[Counter::kAuthenticationWrongCode],
                      .unsupported = count[Counter::kAuthenticationUnsupported],
                      .replayed = count[Counter::kReplayed]};
  }
  return state;
}

void PtpReceiver::log_findings(LogLevel level) {
  // The first one is why; the others may matter once it is mended.
  bool decisive = true;
  for (const diagnosis::Finding& finding : diagnosis::diagnose_all(seen(now()))) {
    if (decisive) {
      log()(level, "{}", diagnosis::sentence(finding));
    } else {
      log()(level, "also: {}{}{}", finding.seen, finding.expected.empty() ? "" : "; expected ",
            finding.expected);
    }
    decisive = false;
  }
}

// Before the next sample, which would be seconds off. The clock is never stepped for it.
void PtpReceiver::follow_scale_change() {
  if (real_clock() != nullptr && real_clock()->take_scale_change()) node_.on_new_reference();
}

int PtpReceiver::finish() {
  record_.log_summary();
  if (!node_.locked()) log_findings(LogLevel::kNotice);
  log_peer_delay(node_.port().peer_delay());
  log_unusual(node_.port().counters());
  return record_.exit_code();
}

ptp::ManagedPort PtpReceiver::managed_port() {
  return data_sets(options(), facts_, node_.port(), record_, now());
}

std::string PtpReceiver::status(const ptp::ManagementCounters& management) {
  const StatusOfPort port{options(), facts_, seconds_since_start(), management};
  return receiver_status(port, node_.port(), record_, seen(now()), now());
}

}  // namespace ftcs::daemon
