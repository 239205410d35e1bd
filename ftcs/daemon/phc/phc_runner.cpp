// SPDX-License-Identifier: MIT
#include "ftcs/daemon/phc/phc_runner.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <string_view>
#include <utility>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/watch/follower_watch.h"
#include "ftcs/platform/stop_flag.h"
#include "ftcs/time/duration.h"

namespace ftcs::daemon {
namespace {

using platform::ClockAccess;
using platform::ClockDevice;

node::ClockFollowerConfig follower_config(const PhcOptions& options) {
  node::ClockFollowerConfig follower;
  DisciplineConfig& config = follower.discipline;
  config.servo = options.servo;
  config.largest_rate_change = options.steering.largest_rate_change;
  config.servo.sync_interval =
      Nanoseconds{static_cast<std::int64_t>(static_cast<double>(kNsPerSecond) / options.rate_hz)};
  config.servo.two_way.fixed_path_delay = Nanoseconds{0};  // ReadingMessages has taken it off
  config.servo.linuxptp_pi.first_step_threshold = options.first_step_threshold;
  config.servo.linuxptp_pi.step_threshold = options.step_threshold;
  if (options.step_threshold > Nanoseconds{0}) {
    config.step = {StepMode::kAlways, options.step_threshold};
  } else if (options.first_step_threshold > Nanoseconds{0}) {
    config.step = {StepMode::kFirst, options.first_step_threshold};
  }
  return follower;
}

Result<UtcConfig, std::string> utc_config(const PhcOptions& options) {
  UtcConfig utc;
  utc.epoch = options.epoch;
  if (options.free_running) utc.epoch = {true, 0, {}, {}, {}};  // comparing alone harms nothing
  utc.kernel_leap = options.kernel_leap;
  if (options.leap_file.empty()) return utc;
  auto list = LeapSeconds::read_file(options.leap_file);
  if (!list) return list.error();
  utc.leap_seconds = std::move(*list);
  return utc;
}

}  // namespace

Result<ClockDevice, platform::OsError> open_clock(platform::Kernel& kernel, const std::string& name,
                                                  ClockAccess access) {
  if (name == "CLOCK_REALTIME") return ClockDevice::open_system(kernel, access);
  // Linux 6.17 has them: no device of theirs can be compared with a PTP clock's in one call yet.
  if (name.starts_with("CLOCK_AUX")) {
    return platform::os_error(
        EOPNOTSUPP, name +
                        " (ftcs ethercat run --plant-time aux0 reads such a clock; expected here: "
                        "CLOCK_REALTIME, /dev/ptpN or an interface)");
  }
  if (name.find('/') != std::string::npos) return ClockDevice::open_phc(kernel, name, access);
  return ClockDevice::open_phc_of(kernel, name, access);
}

Result<std::unique_ptr<PhcRunner>, std::string> PhcRunner::open(platform::Kernel& kernel,
                                                                const PhcOptions& options,
                                                                Log& log) {
  auto utc = utc_config(options);
  if (!utc) return utc.error();
  auto source = open_clock(kernel, options.source, ClockAccess::kRead);
  if (!source) return source.error().message();
  const ClockAccess access = options.free_running ? ClockAccess::kRead : ClockAccess::kSteer;
  auto device = open_clock(kernel, options.sink, access);
  if (!device) return device.error().message();
  auto comparison = ClockComparison::make(kernel, *source, *device);
  if (!comparison) return comparison.error();
  platform::Descriptor pair;
  if (!options.free_running) {
    auto held = device->hold_pair_with(*source);
    if (!held)
      return source->name() + " follows " + device->name() +
             " already: two clocks that follow each other run away together";
    pair = std::move(*held);
  }
  const std::string name = device->name();
  utc->reference_is_utc = source->is_system();
  const RateLimits limits = steering_limits(*device, options.servo.limits);
  platform::KernelClock clock(std::move(*device), limits, !options.free_running);
  if (const auto error = clock.failure()) return describe(name, *error);
  auto sink = std::make_unique<RealClock>(kernel, log, std::move(clock), std::move(*utc));
  // Not make_unique: the constructor is private.
  return std::unique_ptr<PhcRunner>(new PhcRunner(
      kernel, options, log,
      {std::move(*source), std::move(sink), std::move(*comparison), std::move(pair)}));
}

PhcRunner::PhcRunner(platform::Kernel& kernel, const PhcOptions& options, Log& log, Clocks clocks)
    : kernel_(kernel),
      options_(options),
      log_(log),
      source_(std::move(clocks.source)),
      sink_(std::move(clocks.sink)),
      comparison_(std::move(clocks.comparison)),
      pair_(std::move(clocks.pair)),
      follower_(follower_config(options), sink_->clock()) {
  // With -O the sink shows the source's time plus a constant; else the source is TAI.
  if (options.sink_ahead_s) {
    const int ahead_of_utc = sink_->is_system() ? -*options.sink_ahead_s : UtcConfig{}.utc_offset;
    sink_->set_fixed_scale(ahead_of_utc, *options.sink_ahead_s);
    return;
  }
  if (options.automatic || options.wait_for_port) return;  // the port will tell
  ReferenceScale scale;
  scale.tai = sink_->is_system();
  sink_->set_reference_scale(scale);
}

void PhcRunner::follow_port(PortWatch watch, const std::optional<Pairing>& pairing) {
  watch_.emplace(std::move(watch));
  pairing_ = pairing;
  following_ = false;
}

std::optional<PortWatch> PhcRunner::take_moved_port() {
  return port_moved_ ? std::exchange(watch_, std::nullopt) : std::nullopt;
}

void PhcRunner::set_scale() {
  const PortWatch::Port& port = *watch_->port();
  if (options_.sink_ahead_s ||
      std::exchange(scales_heard_, port.scale_answers) == port.scale_answers)
    return;
  sink_->set_reference_scale(port.scale);
}

// Before the next sample, which would be seconds off. The clock is never stepped for it.
void PhcRunner::follow_scale_change() {
  if (sink_->take_scale_change()) follower_.on_new_reference();
}

// A port that transmits follows nobody: its adapter's clock may show anything, unless the system
// clock leads it or was said to.
bool PhcRunner::port_is_usable() const {
  if (watch_->is_receiving()) return true;
  return watch_->is_transmitting() && (source_.is_system() || options_.system_may_lead);
}

bool PhcRunner::may_follow() {
  if (!watch_) return true;
  watch_->attend(kernel_.clock_ns(CLOCK_MONOTONIC_RAW));
  bool may = port_is_usable();
  if (pairing_) {
    const auto wanted = pairing(*watch_, options_.system_may_lead);
    may = wanted == pairing_;
    port_moved_ = wanted && !may;
  }
  if (may) set_scale();
  if (may == following_) return may;
  following_ = may;
  const std::string_view state =
      watch_->port() ? to_string(watch_->port()->state) : std::string_view{"silent"};
  log_(LogLevel::kNotice, "the PTP port is {}: {}", state,
       may           ? "following"
       : port_moved_ ? "another clock is to follow now"
                     : "keeping the last rate");
  if (may && discipline().counters().commands > 0) follower_.on_new_reference();
  return may;
}

int PhcRunner::run() {
  log_(LogLevel::kInfo, "{} {} {} (compared by {}; servo {})", sink_->name(),
       options_.free_running ? "is compared with" : "follows", source_.name(), comparison_.method(),
       servo_kind_name(options_.servo.kind));
  if (options_.watch.is_wanted()) {
    auto opened = Watch::open(options_.watch);
    if (!opened) {
      log_(LogLevel::kError, "{}", opened.error());
      return kRuntimeError;
    }
    observers_ = std::move(*opened);
    log_(LogLevel::kNotice, "{}", observers_->where());
  }
  const platform::StopFlag stop;
  const std::int64_t start = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
  next_raw_ns_ = start_ns_ = start;
  const auto is_over = [&] {
    return options_.duration &&
           kernel_.clock_ns(CLOCK_MONOTONIC_RAW) - start >= options_.duration->floor_ns();
  };
  while (!stop.is_set() && !failure_ && !port_moved_ && !is_over()) {
    wait();
    log_.flush();
    const bool may = may_follow();
    follow_scale_change();
    if (kernel_.clock_ns(CLOCK_MONOTONIC_RAW) >= next_raw_ns_) {
      schedule_next();
      if (may) {
        take_sample();
      } else {
        on_silence();
      }
    }
    ServoSnapshot servo = discipline().latest().servo;
    servo.path_delay = half_width_;
    const auto wrong =
        sink_->attend(discipline().counters().commands > 0, discipline().locked(), servo);
    if (wrong) fail(*wrong);
    follow_scale_change();
    const std::int64_t now_ns = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
    service_.turn(FreeRunningTime::from_ns(now_ns), may && discipline().locked(),
                  [&] { return diagnosis::sentence(finding(may)); });
    publish(now_ns, may);
  }
  service_.stopping();
  sink_->stop();
  if (!failure_) failure_ = sink_->refusal();
  if (failure_) {
    log_(LogLevel::kError, "{}", *failure_);
    return kRuntimeError;
  }
  return finish();
}

diagnosis::Finding PhcRunner::finding(bool follows) const {
  using diagnosis::Cause;
  if (!follows) {
    const bool answers = watch_ && watch_->port();
    return {
        Cause::kNoAnnounce,
        fmt::format(
            "{} waits for the PTP port at {}, which {}", sink_->name(), options_.port.socket,
            answers ? fmt::format("is {}", to_string(watch_->port()->state)) : "does not answer"),
        "a port in the state SLAVE", "-z names its socket, -n its domain; see its own status"};
  }
  if (const auto refused = sink_->refusal()) return {Cause::kTimescale, *refused, "", ""};
  const Telemetry& seen = discipline().latest();
  return {discipline().locked() ? Cause::kLocked : Cause::kAcquiring,
          fmt::format("{} is {:.0f} ns from {}, rate {:+.0f} ppb", sink_->name(),
                      seen.servo.offset.ns(), source_.name(), seen.tracking_rate.ppb()),
          "", ""};
}

void PhcRunner::publish(std::int64_t raw_ns, bool follows) {
  constexpr std::int64_t kBetweenNs = 250'000'000;
  if (!observers_ || raw_ns < next_state_ns_) return;
  next_state_ns_ = raw_ns + kBetweenNs;
  WatchState state =
      watch_state(discipline(), servo_kind_name(options_.servo.kind), finding(follows));
  state.kind.set("phc");
  state.target.set(sink_->name());
  state.reference.set(source_.name());
  if (discipline().latest().servo.offset_known) state.delay_ns = half_width_.ns();
  state.uptime_s = static_cast<double>(raw_ns - start_ns_) / static_cast<double>(kNsPerSecond);
  observers_->feed().publish(state);
}

// Until the next reading is due or a correction has to end.
void PhcRunner::wait() {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  constexpr std::int64_t kLongestMs = 250;  // a signal just before poll(2) is noticed after this
  const std::int64_t until_sample = next_raw_ns_ - kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
  if (until_sample <= 0) return;
  sink_->before_wait(until_sample);
  pollfd timer{sink_->wake_descriptor(), POLLIN, 0};
  const std::int64_t ms = std::min((until_sample + kNsPerMs - 1) / kNsPerMs, kLongestMs);
  if (kernel_.poll({&timer, 1}, static_cast<int>(ms)) > 0) sink_->on_wake();
}

void PhcRunner::schedule_next() {
  const auto period =
      static_cast<std::int64_t>(static_cast<double>(kNsPerSecond) / options_.rate_hz);
  const std::int64_t now = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
  next_raw_ns_ += period;
  if (next_raw_ns_ <= now) next_raw_ns_ = now + period;  // a long pause is not made up for
}

void PhcRunner::take_sample() {
  const auto comparison = comparison_.read(options_.readings);
  if (!comparison) {
    const auto& error = comparison.error();
    if (error.kind == platform::OsErrorKind::kNoSuchDevice) return fail(error.message());
    if (!reading_failed_) log_(LogLevel::kWarning, "{}", error.message());
    reading_failed_ = true;
    on_silence();
    return;
  }
  reading_failed_ = false;
  const auto instant = sink_->clock().from_stamp(comparison->sink_ns);
  if (!instant) return;  // somebody has just stepped the clock
  if (!sink_->admits(ReferenceTime::from_ns(comparison->source_ns), *instant)) {
    on_silence();
    return;
  }
  // As it was read, before the servo acts on it.
  const Duration offset = offset_from_reference(sink_->clock().local_of(comparison->sink_ns),
                                                ReferenceTime::from_ns(comparison->source_ns));
  const std::uint64_t steps = discipline().counters().steps;
  // A classic servo takes the middle of every reading, as phc2sys does.
  const bool weighs_lateness = options_.servo.kind == ServoKind::kAdaptive;
  for (const auto& message : messages_.of(*comparison, weighs_lateness)) {
    follower_.on_pair({message.direction, message.source, *instant}, std::nullopt);
    take_notes();
  }
  half_width_ = Duration::from_whole_ns(comparison->delay_ns).half();
  if (!failure_) report(offset, comparison->delay_ns, discipline().counters().steps > steps);
}

void PhcRunner::on_silence() {
  follower_.on_silence();
  take_notes();
}

// Samples are reported by the reading, whose two messages are one.
void PhcRunner::take_notes() {
  while (const auto event = follower_.next()) {
    const auto* note = std::get_if<node::Note>(&*event);
    if (note == nullptr || note->kind != node::NoteKind::kClockRefused) continue;
    const std::string text = describe(sink_->name(), note->error);
    if (node::is_lasting(note->error)) {
      fail(text);
    } else {
      log_(LogLevel::kWarning, "{}", text);
    }
  }
}

void PhcRunner::report(Duration offset, std::int64_t delay_ns, bool stepped) {
  SampleRecord record;
  record.telemetry = discipline().latest();
  record.offset = offset;  // as it was seen, whatever the servo made of it
  record.telemetry.servo.path_delay = Duration::from_whole_ns(delay_ns);
  if (stepped) record.telemetry.servo.state = ServoState::kJump;
  const bool used = record.telemetry.verdict == SampleVerdict::kUsed;
  summary_.add(record);
  if (observers_) {
    record.time_s = static_cast<double>(kernel_.clock_ns(CLOCK_MONOTONIC_RAW) - start_ns_) /
                    static_cast<double>(kNsPerSecond);
    observers_->feed().add(watch_point(record));
  }
  if (options_.samples_per_summary < 2 || !used) {
    log_(LogLevel::kInfo, "{}",
         phc2sys_line(record, sink_->name(), source_.is_system() ? "sys" : "phc"));
    return;
  }
  if (const auto text = summary_.add_recent(record, options_.samples_per_summary)) {
    log_(LogLevel::kInfo, "{} {}", sink_->name(), *text);
  }
}

void PhcRunner::fail(const std::string& reason) {
  if (!failure_) failure_ = reason;
}

int PhcRunner::finish() {
  const bool locked = discipline().locked();
  summary_.log(log_, discipline().counters(), locked, "readings");
  return locked ? kSuccess : kNotLocked;
}

}  // namespace ftcs::daemon
