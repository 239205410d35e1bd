// SPDX-License-Identifier: MIT
#include "ftcs/daemon/monitor_receiver.h"

#include <utility>

#include "ftcs/daemon/status_report.h"
#include "ftcs/daemon/watch/follower_watch.h"
#include "ftcs/platform/stop_flag.h"

namespace ftcs::daemon {
namespace {

// ptp4l may need some seconds to select a transmitter; its longest usual Sync interval is 2 s.
constexpr Duration kPatience{std::chrono::seconds{10}};
// Two-way samples are rarer than Syncs.
constexpr std::uint64_t kSyncsWithoutDelay = 32;
constexpr int kReportsAtOnce = 64;
constexpr int kAnswersAtOnce = 16;
// For an answer of ptp4l before anything runs, and once its reports come.
constexpr int kPatienceMs = 500;
constexpr Duration kAnswerPatience{std::chrono::seconds{2}};

PortAddress ptp4l_address(const PtpOptions& options) {
  return {options.monitor.management, options.protocol.domain, options.protocol.major_sdo_id};
}

}  // namespace

MonitorReceiver::MonitorReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                                 std::unique_ptr<platform::TimestampClock> timestamps,
                                 const PortFacts& facts, RealClock* real_clock)
    : PtpPort(kernel, options, log, std::move(timestamps), real_clock),
      facts_(facts),
      follower_(this->options(), log, clock(), now(), has_hardware_stamps(), "ptp4l", gate()) {}

std::optional<platform::OsError> MonitorReceiver::open_source() {
  auto socket = platform::LocalSocket::bind(options().monitor.stamps);
  if (!socket) return socket.error();
  socket_.emplace(std::move(*socket));
  transport().watch(socket_->descriptor());
  auto client = ManagementClient::open(ptp4l_address(options()));
  if (!client) return client.error();
  client_.emplace(std::move(*client));
  transport().watch(client_->descriptor());
  return std::nullopt;
}

void MonitorReceiver::start(FreeRunningTime now) {
  follower_.begin();
  last_report_ = now;
  follower_.set_watch(watch());
  log()(LogLevel::kNotice, "following the {} timestamps of a ptp4l with 'slave_event_monitor {}'",
        has_hardware_stamps() ? "hardware" : "software", options().monitor.stamps);
}

void MonitorReceiver::wait_until(FreeRunningTime underlying) {
  transport().wait_watched(underlying);
}

void MonitorReceiver::housekeeping(FreeRunningTime now) {
  ask_ptp4l(now);
  read_answers(now);
  follow_scale_change();
  read_reports();
  follower_.on_silence();
  if (real_clock() != nullptr) {
    const bool steering = follower_.discipline().counters().commands > 0;
    const auto wrong =
        real_clock()->attend(steering, follower_.locked(), follower_.discipline().latest().servo);
    if (wrong) fail(*wrong);
    follow_scale_change();
  }
  watch_for_silence(now);
  log_lock();
  service().turn(now, follower_.locked(), [this] { return diagnosis::sentence(finding()); });
  publish(now, [this] {
    WatchState state = watch_state(follower_.discipline(),
                                   servo_kind_name(options().follower.servo.kind), finding());
    if (source_.transmitter()) state.reference.set(to_text(*source_.transmitter()).view());
    return state;
  });
}

diagnosis::Finding MonitorReceiver::finding() const {
  using diagnosis::Cause;
  if (!source_.transmitter() || silent_) {
    return {Cause::kNoAnnounce,
            fmt::format("no timestamps of a ptp4l come to {}", options().monitor.stamps),
            "a ptp4l in the state SLAVE or UNCALIBRATED",
            fmt::format("'slave_event_monitor {}' and 'free_running 1' in its configuration",
                        options().monitor.stamps)};
  }
  const Telemetry& seen = follower_.discipline().latest();
  if (delays_missing_ && !seen.servo.offset_known) {
    return {Cause::kNoDelayResp, "ptp4l reports Syncs but no delays", "a delay now and then",
            "-P if it measures peer to peer, or start ftcs after it"};
  }
  if (!seen.servo.offset_known)
    return {Cause::kAcquiring, "ptp4l reports, the path delay is not known yet", "", ""};
  return {follower_.locked() ? Cause::kLocked : Cause::kAcquiring,
          fmt::format("offset {:.0f} ns, path delay {:.0f} ns, rate {:+.0f} ppb",
                      seen.servo.offset.ns(), seen.servo.path_delay.ns(), seen.tracking_rate.ppb()),
          "", ""};
}

// Before the next sample, which would be seconds off. The clock is never stepped for it.
void MonitorReceiver::follow_scale_change() {
  if (real_clock() != nullptr && real_clock()->take_scale_change()) follower_.on_new_reference();
}

// A real clock shows UTC or TAI, chrony UTC; ptp4l's reports do not say which the reference does.
// Nor do they have its peer delay messages, but it tells what they came to.
void MonitorReceiver::ask_ptp4l(FreeRunningTime now) {
  constexpr Duration kInterval{std::chrono::seconds{1}};
  if (needs_scale() && now >= next_scale_question_) {
    next_scale_question_ = now + kInterval;
    client_->ask(ptp::ManagementId::kTimePropertiesDataSet);
  }
  if (options().protocol.peer_to_peer() && source_.counters().syncs > 0 &&
      now >= next_link_question_) {
    next_link_question_ = now + kInterval;
    client_->ask(ptp::ManagementId::kPortDataSet);
  }
  if (waits_for_scale_since_ && now - *waits_for_scale_since_ > kAnswerPatience) {
    fail("ptp4l does not answer on " + options().monitor.management +
         " (--ptp4l-socket), and nothing else says whether its reference shows TAI or UTC");
  }
}

void MonitorReceiver::read_answers(FreeRunningTime now) {
  for (int i = 0; i < kAnswersAtOnce; ++i) {
    const auto answer = client_->next_answer();
    if (!answer) return;
    if (const auto* properties = std::get_if<ptp::TimePropertiesDataSet>(&*answer)) {
      scale_known_ = true;
      waits_for_scale_since_.reset();
      set_scale(reference_scale(properties->flags, properties->utc_offset));
    } else if (const auto* port = std::get_if<ptp::PortDataSet>(&*answer)) {
      on_port_data(*port, now);
    }
  }
}

// A boundary clock answers for each of its ports: the one that receives time is meant.
void MonitorReceiver::on_port_data(const ptp::PortDataSet& port, FreeRunningTime now) {
  const bool receives =
      port.state == ptp::PortState::kTimeReceiver || port.state == ptp::PortState::kUncalibrated;
  if (!receives || port.mean_link_delay <= Duration{}) return;  // none yet
  const ptp::EmitPeerDelay measured{port.mean_link_delay, {}, false, {}};
  if (const auto wrong = follower_.on_link_delay(measured, now, source_.sync_interval())) {
    fail(*wrong);
  }
}

void MonitorReceiver::read_reports() {
  for (int i = 0; i < kReportsAtOnce; ++i) {
    const auto datagram = socket_->receive();
    if (!datagram) return;
    const ptp::MonitorReport report = source_.on_datagram(datagram->bytes);
    if (report.size > 0) last_report_ = now();
    for (const ptp::MonitorSample& sample : report.view()) on_sample(sample);
  }
}

// ptp4l's stamps are readings of the clock that is steered here: its steps are none of the
// reference.
void MonitorReceiver::on_sample(const ptp::MonitorSample& sample) {
  if (needs_scale() && !scale_known_) {
    if (!waits_for_scale_since_) waits_for_scale_since_ = now();
    return;
  }
  const auto stamp = timestamps().convert({sample.local_ns, sample.local_ns});
  if (!stamp) return;  // the clock was set in between: counted there
  const auto before = source_.transmitter();
  const auto event = source_.on_sample(sample, oscillator().from_underlying(stamp->time));
  if (!event) return;
  if (source_.transmitter() != before) {
    log()(LogLevel::kNotice, "ptp4l: samples of the transmitter {}",
          to_text(*source_.transmitter()).view());
    follower_.on_new_link();
    next_link_question_ = {};
  }
  if (event->new_reference) {
    log()(LogLevel::kWarning, "ptp4l: another transmitter, or its time jumped; starting anew");
    follower_.on_new_reference();
  }
  if (const auto wrong = follower_.on_pair(event->pair, now(), source_.sync_interval()))
    return fail(*wrong);
  feed_others(follower_.record());
}

void MonitorReceiver::watch_for_silence(FreeRunningTime now) {
  const bool silent = now - last_report_ > kPatience;
  if (silent && !silent_) {
    log()(
        LogLevel::kWarning,
        "nothing from ptp4l for {:.0f} s: is it running, in state SLAVE or UNCALIBRATED, and does "
        "its configuration say 'slave_event_monitor {}' and 'free_running 1'?",
        kPatience.seconds(), options().monitor.stamps);
  }
  if (!silent && silent_) log()(LogLevel::kNotice, "ptp4l reports again");
  silent_ = silent;
  const ptp::MonitorCounters& counters = source_.counters();
  if (!options().protocol.peer_to_peer() && !delays_missing_ && counters.delays == 0 &&
      counters.syncs >= kSyncsWithoutDelay) {
    delays_missing_ = true;
    log()(LogLevel::kWarning,
          "ptp4l reports Syncs but no delays: if it measures peer to peer, say so (-P), or start "
          "ftcs after it");
  }
}

void MonitorReceiver::log_lock() {
  const bool locked = follower_.locked();
  if (locked != was_locked_)
    log()(LogLevel::kNotice, "ptp4l: {}", locked ? "locked" : "not locked");
  was_locked_ = locked;
}

ptp::PortState MonitorReceiver::state() const {
  if (follower_.locked()) return ptp::PortState::kTimeReceiver;
  return source_.transmitter() ? ptp::PortState::kUncalibrated : ptp::PortState::kListening;
}

int MonitorReceiver::finish() {
  follower_.log_summary();
  const ptp::MonitorCounters& counters = source_.counters();
  log()(
      LogLevel::kNotice,
      "reports: {} Syncs, {} delays; {} malformed, {} unknown TLVs, {} missed Syncs, {} repeated, "
      "{} restarts, {} transmitter changes, {} reference jumps, {} steps of the clock by others",
      counters.syncs, counters.delays, counters.malformed, counters.unknown_tlvs,
      counters.missed_syncs, counters.repeated, counters.restarts, counters.transmitter_changes,
      counters.reference_jumps, timestamps().foreign_steps());
  return follower_.record().exit_code();
}

ptp::ManagedPort MonitorReceiver::managed_port() {
  return data_sets(options(), facts_, state(), source_.transmitter(), follower_.record(), now());
}

std::string MonitorReceiver::status(const ptp::ManagementCounters& management) {
  const StatusOfPort port{options(), facts_, seconds_since_start(), management};
  return monitor_status(port, source_, state(), follower_.record(), finding(), now());
}

bool complete_by_ptp4l(PtpOptions& options, Log& log) {
  using platform::TimestampMode;
  const platform::StopFlag stop;  // the client's folder goes, whatever ends the wait
  std::optional<ptp::PortPropertiesNp> properties;
  std::optional<ptp::PortDataSet> port;
  if (auto client = ManagementClient::open(ptp4l_address(options))) {
    properties = client->ask_and_wait<ptp::PortPropertiesNp>(ptp::ManagementId::kPortPropertiesNp,
                                                             kPatienceMs);
    port = client->ask_and_wait<ptp::PortDataSet>(ptp::ManagementId::kPortDataSet, kPatienceMs);
  }
  if (options.timestamps == TimestampMode::kBestAvailable) {
    const bool hardware = properties && properties->timestamping != 0;
    options.timestamps = hardware ? TimestampMode::kHardware : TimestampMode::kSoftware;
    if (!properties) {
      log(LogLevel::kNotice,
          "no ptp4l answers on {} (--ptp4l-socket): taking its timestamps for software ones (-H -i "
          "for hardware)",
          options.monitor.management);
    }
  }
  if (port && port->delay_mechanism == ptp::kPeerToPeerMechanism) {
    options.protocol.delay_mechanism = ptp::DelayMechanism::kPeerToPeer;
  }
  if (!options.interface.empty()) return !stop.is_set();
  const bool hardware = options.timestamps == TimestampMode::kHardware;
  // Software timestamps are CLOCK_REALTIME on every interface; this one is always there.
  options.interface = hardware && properties ? std::string(properties->interface.view()) : "lo";
  return !stop.is_set();
}

}  // namespace ftcs::daemon
