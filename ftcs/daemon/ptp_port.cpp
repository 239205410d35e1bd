// SPDX-License-Identifier: MIT
#include "ftcs/daemon/ptp_port.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/monitor_receiver.h"
#include "ftcs/daemon/ptp_receiver.h"
#include "ftcs/daemon/ptp_transmitter.h"
#include "ftcs/platform/network_interface.h"

namespace ftcs::daemon {
namespace {

VirtualClockConfig clock_config(const PtpOptions& options,
                                const platform::TimestampClock::RealtimeReading& start) {
  VirtualClockConfig config;
  config.free_running = start.free_running;
  config.local = LocalTime::from_ns(start.realtime_ns) + options.clock.initial_offset;
  config.limits = options.follower.servo.limits;
  return config;
}

}  // namespace

PtpPort::PtpPort(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                 std::unique_ptr<platform::TimestampClock> timestamps, RealClock* real_clock)
    : kernel_(kernel),
      options_(options),
      log_(log),
      timestamps_(std::move(timestamps)),
      start_(options.clock.start ? *options.clock.start : timestamps_->read_realtime()),
      oscillator_(timestamps_->source(), Rate::from_ppb(options.clock.skew_ppb),
                  start_.free_running),
      virtual_clock_(oscillator_, clock_config(options, start_)),
      real_clock_(real_clock),
      transport_(kernel, options.socket, *timestamps_, *this) {}

int PtpPort::run() {
  const platform::StopFlag stop;
  std::optional<platform::HangupFlag> hangup;
  if (options_.protocol.security) hangup.emplace();
  return run([this, &stop, &hangup] {
    if (hangup && hangup->take()) read_keys_again();
    return stop.is_set();
  });
}

int PtpPort::run(const std::function<bool()>& stop) {
  for (const std::string& note : options_.notes) log_(LogLevel::kNotice, "{}", note);
  report_keys();
  if (const auto error = open_source()) {
    fail(error->message());
    log_(LogLevel::kError, "{}", *failure_);
    return kRuntimeError;
  }
  if (!open_management() || !open_feed() || !open_time_page() || !open_watch())
    return kRuntimeError;
  if (options_.once_open) {
    if (const auto wrong = options_.once_open()) {
      log_(LogLevel::kError, "{}", *wrong);
      return kRuntimeError;
    }
  }
  report_stamps();
  if (real_clock_ != nullptr) transport_.watch(real_clock_->wake_descriptor());
  start_port();
  std::optional<FreeRunningTime> end;
  if (options_.duration) end = now() + *options_.duration;
  while (!stop() && !failure_ && !(end && now() >= *end)) turn(end);
  service_->stopping();
  if (real_clock_ != nullptr) {
    real_clock_->stop();
    if (!failure_) failure_ = real_clock_->refusal();
  }
  if (failure_) {
    log_(LogLevel::kError, "{}", *failure_);
    return kRuntimeError;
  }
  return finish();
}

// An interface that was down before the start is down for the core from its first state on.
void PtpPort::start_port() {
  start(now());
  started_ = true;
  if (transport_.closed()) return on_link_change(false, now());
  const auto trouble = diagnosis::link_trouble(seen_of_link());
  if (transport_.socket() == nullptr || !trouble) return;
  log_(LogLevel::kNotice, "port 1 ({}): {}; {}", options_.interface, trouble->seen,
       trouble->remedy);
}

void PtpPort::turn(std::optional<FreeRunningTime> end) {
  constexpr Duration kLongestTurn{std::chrono::seconds{1}};
  FreeRunningTime until = now() + kLongestTurn;
  if (end) until = std::min(until, *end);
  if (const auto due = deadline()) until = std::min(until, *due);
  if (real_clock_ != nullptr) real_clock_->before_wait();
  wait_until(oscillator_.to_underlying(until));
  if (const auto due = deadline(); due && now() >= *due) on_timer(now());
  for (const ptp::EventId& id : std::exchange(unsent_, {})) {
    on_sent(id, std::nullopt, now());
  }
  report_stamps();
  if (management_) management_->serve(*managed(), now());
  housekeeping(now());
  log_.flush();
}

void PtpPort::report_keys() {
  if (!options_.protocol.security) {
    const std::string& file = options_.protocol.authentication.sa_file;
    if (!file.empty()) {  // allowed, as for ptp4l: its ports need not name one
      log_(LogLevel::kWarning, "sa_file {}: without spp no message is authenticated", file);
    }
    return;
  }
  log_(LogLevel::kNotice, "messages are authenticated: {}",
       options_.protocol.security->description());
  if (options_.protocol.security->is_readable_by_others()) {
    log_(LogLevel::kWarning, "sa_file {}: everybody may read the keys; expected mode 0600 or 0640",
         options_.protocol.authentication.sa_file);
  }
}

void PtpPort::read_keys_again() {
  if (const auto wrong = options_.protocol.security->load()) {
    log_(LogLevel::kWarning, "{}; the keys before stay in use", *wrong);
  } else {
    report_keys();
  }
}

bool PtpPort::open_time_page() {
  if (options_.feeds.time_page.empty()) return true;
  auto page = platform::TimePage::open(options_.feeds.time_page);
  if (page) {
    publisher_.emplace(std::move(*page));
  } else {
    log_(LogLevel::kError, "--time-page: {}", page.error().message());
  }
  return page.ok();
}

void PtpPort::publish_time(const TimeBound& bound) {
  if (!publisher_) return;
  RawReading reading;
  reading.before_ns = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
  reading.free_running = now();
  reading.after_ns = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
  publisher_->publish(bound, reading);
}

bool PtpPort::open_feed() {
  auto feed = TimeFeed::open(kernel_, options_, log_);
  if (feed) {
    feed_.emplace(std::move(*feed));
  } else {
    log_(LogLevel::kError, "{}", feed.error());
  }
  return feed.ok();
}

bool PtpPort::open_watch() {
  if (!options_.watch.is_wanted()) return true;
  auto opened = Watch::open(options_.watch);
  if (!opened) {
    fail(opened.error());
    log_(LogLevel::kError, "{}", *failure_);
    return false;
  }
  watch_ = std::move(*opened);
  log_(LogLevel::kNotice, "{}", watch_->where());
  return true;
}

void PtpPort::set_scale(const ReferenceScale& scale) {
  if (real_clock_ != nullptr) real_clock_->set_reference_scale(scale);
  if (feed_) feed_->set_scale(scale);
}

void PtpPort::feed_others(const FollowerRecord& record) {
  if (!feed_ || !feed_->is_on()) return;
  const auto reading = timestamps_->read_realtime();
  const FreeRunningTime instant = oscillator_.from_underlying(reading.free_running);
  feed_->publish(record, clock().local_at(instant), reading.free_running, reading.realtime_ns);
}

bool PtpPort::open_management() {
  if (options_.management.socket.empty() || managed() == nullptr) return true;
  auto opened = ManagementServer::open(options_.management.socket);
  if (opened) {
    management_.emplace(std::move(*opened));
    transport_.watch(management_->descriptor());
    return true;
  }
  if (options_.management.is_required) {
    log_(LogLevel::kError, "{}", opened.error().message());
    return false;
  }
  // Another instance, on another port, has the usual place: that is no reason not to follow.
  log_(LogLevel::kNotice, "no management socket: {} (--uds_address names another)",
       opened.error().message());
  return true;
}

void PtpPort::wait_until(FreeRunningTime underlying) {
  // What came before a timer was due is handled before it, even when this process was held up; but
  // no more than this, so that a flood holds up no timer.
  constexpr int kMostBeforeTimers = 16;
  for (int handled = 0; handled < kMostBeforeTimers; ++handled) {
    if (!transport_.wait_until(underlying)) return;
    underlying = timestamps_->source().now();
  }
}

void PtpPort::perform(const ptp::Action& action) {
  if (const auto* message = std::get_if<ptp::SendMessage>(&action)) {
    send(*message);
  } else if (std::holds_alternative<ptp::SenderIsTransmitter>(action)) {
    transmitter_ = sender_;
  } else if (const auto* change = std::get_if<ptp::PortStateChanged>(&action)) {
    log_(LogLevel::kNotice, "port 1 ({}): {} to {} on {}", options_.interface,
         to_string(change->from), to_string(change->to), to_string(change->event));
  }
}

void PtpPort::log_unusual(const ptp::Counters& counters) {
  std::string text;
  const auto add = [&text](std::string_view name, std::uint64_t count) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, count);
  };
  // What stands before it counts good messages.
  for (auto i = static_cast<std::size_t>(ptp::Counter::kTruncated); i < ptp::kCounters; ++i) {
    const auto counter = static_cast<ptp::Counter>(i);
    add(to_string(counter), counters[counter]);
  }
  if (const platform::PtpSocket* socket = transport_.socket()) {
    add("receive_stamp_missing", socket->counters().receive_stamp_missing);
    add("transmit_stamp_late", socket->counters().transmit_stamp_late);
    add("oversized_datagrams", socket->counters().oversized);
    add("unicast_dropped", socket->counters().unicast_dropped);
    add("stranger_dropped", socket->counters().stranger_dropped);
  }
  add("foreign_steps", timestamps_->foreign_steps());
  if (!text.empty()) log_(LogLevel::kNotice, "counted besides: {}", text);
}

void PtpPort::log_peer_delay(const ptp::PeerDelay& peer_delay) {
  const auto delay = peer_delay.mean_link_delay();
  if (!delay) return;
  log_(LogLevel::kNotice, "peer delay {:.0f} ns, the neighbour's clock {:+.0f} ppb against ours{}",
       delay->ns(), peer_delay.neighbor_rate_ratio().ppb(),
       peer_delay.capable() ? "" : ", not 802.1AS capable");
}

void PtpPort::fail(const std::string& reason) {
  if (!failure_) failure_ = reason;
}

std::optional<platform::OsError> PtpPort::hand_over(const ptp::SendMessage& message) {
  using ptp::Destination;
  const auto bytes = message.bytes.view();
  switch (message.destination) {
    case Destination::kSender:
      return transport_.send_to(message.channel, bytes, sender_);
    case Destination::kTransmitter:
      return transport_.send_to(message.channel, bytes, transmitter_);
    case Destination::kNeighbour:
      return transport_.send(message.channel, bytes, platform::Group::kPeerDelay);
    case Destination::kMulticast:
    case Destination::kPeer:
      break;
  }
  return transport_.send(message.channel, bytes);
}

void PtpPort::send(const ptp::SendMessage& message) {
  const auto error = hand_over(message);
  if (error && !send_failed_) log_(LogLevel::kWarning, "{}", error->message());
  send_failed_ = error.has_value();  // one line for a series of failures
  if (error && message.channel == ptp::Channel::kEvent) unsent_.push_back(message.id());
}

void PtpPort::on_message(const platform::ReceivedMessage& message) {
  sender_ = message.sender;
  if (message.channel == ptp::Channel::kGeneral) return on_general(message.bytes, now());
  if (!message.stamp) return;  // counted by the socket
  const FreeRunningTime received = oscillator_.from_underlying(message.stamp->time) -
                                   Duration{options_.protocol.ingress_latency};
  on_event(message.bytes, received, now());
}

void PtpPort::on_transmitted(const platform::TransmittedMessage& message) {
  std::optional<FreeRunningTime> sent;
  if (message.stamp) {
    sent = oscillator_.from_underlying(message.stamp->time) +
           Duration{options_.protocol.egress_latency};
  } else if (!std::exchange(stamp_missed_, true)) {
    log_(LogLevel::kWarning,
         "port 1 ({}): no transmit timestamp within {} ms (tx_timestamp_timeout); one that comes "
         "later "
         "is used, further ones are only counted",
         options_.interface,
         std::chrono::duration_cast<std::chrono::milliseconds>(options_.socket.tx_timestamp_timeout)
             .count());
  }
  on_sent(ptp::event_id(message.bytes), sent, now());
}

void PtpPort::on_link(bool up, const std::string& reason) {
  const auto trouble = up ? std::nullopt : diagnosis::link_trouble(seen_of_link());
  const std::string remedy = trouble ? trouble->remedy : "";
  log_(LogLevel::kNotice, "port 1 ({}): link {}{}{}{}{}", options_.interface, up ? "up" : "down",
       reason.empty() ? "" : ": ", reason, remedy.empty() ? "" : "; ", remedy);
  if (started_) on_link_change(up, now());
}

void PtpPort::on_readable(int descriptor) {
  if (real_clock_ != nullptr && descriptor == real_clock_->wake_descriptor()) {
    real_clock_->on_wake();
  }
}

void PtpPort::report_stamps() {
  const platform::PtpSocket* socket = transport_.socket();
  if (socket == nullptr) return;
  const auto stamps = socket->transmit_stamps();
  if (reported_stamps_ == stamps) return;
  reported_stamps_ = stamps;
  const bool last_resort = stamps == platform::StampSource::kUserSpace;
  log_(last_resort ? LogLevel::kWarning : LogLevel::kInfo,
       "port 1 ({}): receive timestamps by {}, transmit timestamps by {}{}", options_.interface,
       name(socket->receive_stamps()), name(stamps),
       last_resort ? ": expect errors of tens of microseconds" : "");
}

Result<ptp::PortIdentity, platform::OsError> port_identity(platform::Kernel& kernel,
                                                           const PtpOptions& options) {
  if (options.protocol.clock_identity)
    return ptp::PortIdentity{*options.protocol.clock_identity, 1};
  const auto address = platform::identity_address(kernel, options.interface);
  if (!address) return address.error();
  return ptp::PortIdentity{ptp::ClockIdentity::from_mac(*address), 1};
}

Result<PortFacts, platform::OsError> port_facts(platform::Kernel& kernel, const PtpOptions& options,
                                                const PtpClocks& clocks) {
  const auto identity = port_identity(kernel, options);
  if (!identity) return identity.error();
  PortFacts facts{*identity};
  facts.hardware_stamps = clocks.timestamps->is_hardware();
  if (const auto address = platform::identity_address(kernel, options.interface)) {
    facts.address = *address;
  }
  return facts;
}

int run_ptp(platform::Kernel& kernel, const PtpOptions& given) {
  PtpOptions options = given;
  Log log(kernel, options.output == Output::kText ? stdout : stderr, options.log_level);
  if (options.source == Source::kPtp4l && !complete_by_ptp4l(options, log)) return kNotLocked;
  auto clocks = open_ptp_clocks(kernel, options, log);
  if (!clocks) {
    log(LogLevel::kError, "{}", clocks.error());
    return kRuntimeError;
  }
  const auto found = port_facts(kernel, options, *clocks);
  if (!found) {
    log(LogLevel::kError, "{}", found.error().message());
    return kRuntimeError;
  }
  const PortFacts& facts = *found;
  RealClock* const real = clocks->real.get();
  if (options.source == Source::kPtp4l) {
    return MonitorReceiver(kernel, options, log, std::move(clocks->timestamps), facts, real).run();
  }
  if (options.role == Role::kTimeReceiver) {
    return PtpReceiver(kernel, options, log, std::move(clocks->timestamps), facts, real).run();
  }
  return PtpTransmitter(kernel, options, log, std::move(clocks->timestamps), facts).run();
}

}  // namespace ftcs::daemon
