// SPDX-License-Identifier: MIT
#include "apps/ftcs/clock_follower.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "apps/ftcs/real_clock.h"

namespace ftcs::app {
namespace {

// A slew over more than this would take long enough to look like a fault: the user must ask for a
// step.
constexpr Nanoseconds kLargestFirstOffset{1'000'000'000};
constexpr std::size_t kKeptRefusals = 8;
// In a row, each after an exchange with somebody else. One is usual when a transmitter comes back.
constexpr int kSyncsWithoutStamps = 4;
// In units of the noise of one stamp: the mean of a few exchanges is good to half of it, one to
// 0.7.
constexpr double kStartDelayDoubt = 3.0;
constexpr double kAnotherLink = 4.0;

StepPolicy step_policy(const PtpOptions& options) {
  // ptp4l's servo keeps ptp4l's thresholds; all others are continuous unless a first step is asked
  // for.
  if (options.servo.kind == ServoKind::kLinuxptpPi) {
    if (options.step_threshold > Nanoseconds{0}) return {StepMode::kAlways, options.step_threshold};
    if (options.first_step_threshold > Nanoseconds{0}) {
      return {StepMode::kFirst, options.first_step_threshold};
    }
    return {};
  }
  if (!options.first_step) return {};
  return {StepMode::kFirst, options.first_step_threshold};
}

/// Empty, with a notice, where the servo has nothing to keep.
std::string driftfile(const PtpOptions& options, Log& log) {
  if (options.driftfile.empty() || options.servo.kind == ServoKind::kAdaptive)
    return options.driftfile;
  log(LogLevel::kNotice, "driftfile {}: not used, the servo {} keeps no state", options.driftfile,
      servo_kind_name(options.servo.kind));
  return {};
}

/// What makes a learnt rate another clock's.
std::string clock_name(const PtpOptions& options, bool hardware_stamps) {
  const char* steered = options.clock == ClockKind::kVirtual  ? "virtual"
                        : options.clock == ClockKind::kSystem ? "system"
                                                              : "phc";
  return fmt::format("{}, {} clock, {} timestamps, skew {} ppb", options.interface, steered,
                     hardware_stamps ? "hardware" : "software", options.skew_ppb);
}

/// The adaptive servo hears of one direction alone peer to peer: what the link delay moves by, it
/// follows. The others keep ptp4l's filter.
PathDelayConfig link_delay_config(const PtpOptions& options) {
  PathDelayConfig config = options.servo.two_way.path_delay;
  if (options.servo.kind == ServoKind::kAdaptive && !options.delay_filter_given) {
    config.filter.kind = DelayFilterKind::kSteadyMean;
  }
  return config;
}

DisciplineConfig discipline_config(const PtpOptions& options, bool hardware_stamps,
                                   const std::optional<LearntState>& learnt) {
  DisciplineConfig config;
  config.servo = options.servo;
  // Peer to peer: the delay is added to the reference before the servo sees a pair.
  if (options.peer_to_peer()) config.servo.two_way.fixed_path_delay = Nanoseconds{0};
  config.servo.linuxptp_pi.first_step_threshold = options.first_step_threshold;
  config.servo.linuxptp_pi.step_threshold = options.step_threshold;
  config.servo.linuxptp_pi.timestamping =
      hardware_stamps ? TimestampingKind::kHardware : TimestampingKind::kSoftware;
  config.servo.adaptive.steering.first_step_allowed = options.first_step;
  config.servo.adaptive.learnt = learnt;
  config.step = step_policy(options);
  config.largest_first_offset = kLargestFirstOffset;
  config.largest_rate_change = options.steering.largest_rate_change;
  return config;
}

}  // namespace

ClockFollower::ClockFollower(const PtpOptions& options, Log& log, AdjustableClock& clock,
                             FreeRunningTime start, bool hardware_stamps, std::string label)
    : options_(options),
      log_(log),
      clock_(clock),
      start_(start),
      label_(std::move(label)),
      state_(log, driftfile(options, log), options.driftfile_interval,
             clock_name(options, hardware_stamps)),
      discipline_(discipline_config(options, hardware_stamps, state_.learnt()), clock),
      link_delay_(link_delay_config(options)) {
  if (!state_.learnt()) return;
  // At the known rate from now on, long before the first message: what a driftfile is for.
  if (discipline_.start_at(Rate::from_ratio(1.0 / (1.0 + state_.learnt()->rate_deviation))))
    log(LogLevel::kWarning, "{}: the clock refuses the driftfile's rate", label_);
}

std::optional<std::string> ClockFollower::on_pair(const EventPair& emitted, FreeRunningTime now,
                                                  std::optional<Duration> sync_interval) {
  if (options_.peer_to_peer()) {
    if (!link_delay_.known()) {
      waiting_ = emitted;
      return std::nullopt;
    }
    follow_timescale(emitted);
  }
  discipline_.on_announced_interval(sync_interval.value_or(Duration{}));
  if (auto wrong = hear_response(emitted.free_running, now)) return wrong;
  const Steered steered = steer(emitted, now);
  if (steered.failure) return steered.failure;
  const Telemetry& telemetry = steered.telemetry;
  const bool used = telemetry.verdict == SampleVerdict::kUsed;
  std::optional<std::string> failure;
  if (emitted.direction == Direction::kForward) {
    refused_syncs_ = used ? 0 : refused_syncs_ + 1;
    SampleRecord record;
    record.time_s = (now - start_).seconds();
    record.offset_known = telemetry.servo.offset_known;
    record.offset = used ? telemetry.servo.offset : steered.perceived;
    record.telemetry = telemetry;
    if (used) {
      status_.last = record;
      status_.has_sample = true;
      status_.last_local = steered.local;
      last_used_ = emitted.free_running;
    }
    failure = report(record, sync_interval);
  }
  follow_lock(now);
  if (used && locked()) state_.note(telemetry.servo, now);
  return failure;
}

ClockFollower::Steered ClockFollower::steer(EventPair pair, FreeRunningTime now, bool paces) {
  const bool forward = pair.direction == Direction::kForward;
  const Duration delay = delay_taken_off();
  pair.reference = forward ? pair.reference + delay : pair.reference - delay;
  Steered result;
  result.local = clock_.local_at(pair.free_running);
  Telemetry& telemetry = result.telemetry;
  telemetry = discipline_.on_pair(pair, paces);
  if (telemetry.error) result.failure = on_clock_error(*telemetry.error);
  clock_refuses_ = telemetry.error.has_value();
  if (!result.failure && telemetry.offset_refused) {
    result.failure = fmt::format(
        "the first offset is {:.3f} s, more than {} s: set the clock near the reference{} or allow "
        "one step (--first-step)",
        telemetry.servo.offset.seconds(), kLargestFirstOffset.count() / 1e9,
        options_.clock == ClockKind::kVirtual ? " (--offset, 37s if it shows TAI)" : "");
  }
  if (result.failure) return result;
  result.perceived =
      offset_from_reference(result.local, pair.reference + telemetry.servo.path_delay);
  telemetry.servo.path_delay += delay;
  if (telemetry.verdict != SampleVerdict::kUsed) {
    const bool known = forward && telemetry.servo.offset_known;
    note_refusal(telemetry, (now - start_).seconds(),
                 known ? std::optional(result.perceived.ns()) : std::nullopt);
  }
  return result;
}

// Syncs and responses are of one direction, and a servo takes those in order. Which of two comes to
// be known first depends on when their Follow_Ups come.
std::optional<std::string> ClockFollower::hear_stamps(const ptp::PeerStamps& stamps,
                                                      FreeRunningTime now) {
  unstamped_exchanges_ = syncs_without_stamps_ = 0;
  timescale_.on_response(stamps.response);
  if (!shares_timescale() || !timescale_.checked()) return {};
  if (auto wrong = hear_response(stamps.response.free_running, now)) return wrong;
  if (stamps.response.free_running > timescale_.last_sync()) response_ = stamps.response;
  return steer(stamps.request, now, false).failure;
}

std::optional<std::string> ClockFollower::hear_response(FreeRunningTime before,
                                                        FreeRunningTime now) {
  if (!response_ || before <= response_->free_running) return {};
  const EventPair response = *std::exchange(response_, std::nullopt);
  return shares_timescale() ? steer(response, now, false).failure : std::nullopt;
}

void ClockFollower::follow_timescale(const EventPair& sync) {
  const SharedTimescale::Verdict before = timescale_.verdict();
  timescale_.on_sync(sync);
  if (timescale_.verdict() != before) return follow_verdict(before);
  if (!shares_timescale()) return;
  if (unstamped_exchanges_ > 0) ++syncs_without_stamps_;
  unstamped_exchanges_ = 0;
  if (syncs_without_stamps_ < kSyncsWithoutStamps) return;
  forget_stamps();
  start_with_link_delay("the neighbour is not the transmitter any more");
}

void ClockFollower::follow_verdict(SharedTimescale::Verdict before) {
  if (shares_timescale()) {
    start_delay_ = link_delay_.value();
    discipline_.free_path_delay(kStartDelayDoubt * discipline_.latest().servo.timestamp_noise_ns);
    log_(LogLevel::kInfo, "{}: the transmitter's peer delay messages measure time too", label_);
    return;
  }
  const std::string why =
      fmt::format("the transmitter's peer delay messages are {:.0f} ns off its Syncs",
                  timescale_.difference_ns());
  if (before == SharedTimescale::Verdict::kShared) return start_with_link_delay(why);
  log_(LogLevel::kInfo, "{}: {}; the link delay alone counts", label_, why);
}

void ClockFollower::start_with_link_delay(const std::string& why) {
  log_(LogLevel::kWarning, "{}: {}; starting anew with the link delay", label_, why);
  discipline_.on_new_reference();
}

void ClockFollower::forget_stamps() {
  timescale_.reset();
  response_.reset();
  unstamped_exchanges_ = syncs_without_stamps_ = 0;
}

// What one exchange says, against what the servo has found.
bool ClockFollower::is_another_link(Duration mean_link_delay) const {
  const ServoSnapshot& servo = discipline_.latest().servo;
  const Duration difference = mean_link_delay - start_delay_ - servo.path_delay;
  return std::abs(difference.ns()) > kAnotherLink * servo.timestamp_noise_ns;
}

// What may pass is one warning for a series; what will not ends the run.
std::optional<std::string> ClockFollower::on_clock_error(ClockError error) {
  std::string text = describe("the clock", error);
  if (error == ClockError::kGone || error == ClockError::kNotPermitted) return text;
  if (!clock_refuses_) log_(LogLevel::kWarning, "{}: {}", label_, text);
  return std::nullopt;
}

// A delay filter that was asked for filters, and is not gone round.
std::optional<std::string> ClockFollower::on_link_delay(const ptp::EmitPeerDelay& measured,
                                                        FreeRunningTime now,
                                                        std::optional<Duration> sync_interval) {
  if (!link_delay_.add(measured.mean_link_delay, measured.first)) return std::nullopt;
  if (measured.first && shares_timescale() && is_another_link(measured.mean_link_delay)) {
    forget_stamps();
    start_with_link_delay("another link");
  }
  if (waiting_) {
    const EventPair waiting = *std::exchange(waiting_, std::nullopt);
    if (auto wrong = on_pair(waiting, now, sync_interval)) return wrong;
  }
  if (options_.servo.kind != ServoKind::kAdaptive || options_.delay_filter_given) return {};
  if (measured.stamps) return hear_stamps(*measured.stamps, now);
  if (shares_timescale()) ++unstamped_exchanges_;
  return std::nullopt;
}

void ClockFollower::on_new_link() {
  link_delay_.reset();
  waiting_.reset();
  response_.reset();
}

void ClockFollower::on_new_reference() {
  waiting_.reset();
  forget_stamps();
  discipline_.on_new_reference();
}

void ClockFollower::on_new_timescale() {
  forget_stamps();
  discipline_.on_new_timescale();
}

void ClockFollower::on_silence() {
  const Telemetry telemetry = discipline_.on_silence();
  const bool holdover = telemetry.servo.state == ServoState::kHoldover;
  if (holdover && !in_holdover_) {
    const std::string what = refused_syncs_ == 0
                                 ? "no Sync"
                                 : fmt::format("{} Syncs refused, no good one", refused_syncs_);
    log_(LogLevel::kWarning, "{}: {} for a while; keeping the last rate (holdover)", label_, what);
  }
  in_holdover_ = holdover;
  follow_lock(telemetry.reading.free_running);
}

void ClockFollower::follow_lock(FreeRunningTime now) {
  if (!locked()) {
    locked_since_.reset();
  } else if (!locked_since_) {
    locked_since_ = now;
  }
}

void ClockFollower::note_refusal(const Telemetry& telemetry, double time_s,
                                 std::optional<double> offset_ns) {
  status_.refusals.push_back({time_s, telemetry.direction, telemetry.verdict, offset_ns});
  if (status_.refusals.size() > kKeptRefusals) status_.refusals.pop_front();
}

ClockFollower::Status ClockFollower::status(FreeRunningTime now) const {
  Status status = status_;
  if (status.has_sample) status.last_age_s = (now - last_used_).seconds();
  if (locked_since_) status.locked_for_s = (now - *locked_since_).seconds();
  if (since_lock_.count() > 0) status.since_lock = since_lock_.text();
  return status;
}

std::optional<std::string> ClockFollower::report(const SampleRecord& record,
                                                 std::optional<Duration> sync_interval) {
  switch (options_.output) {
    case Output::kText:
      break;
    case Output::kJson:
      fmt::print("{}\n", json_line(record));
      break;
    case Output::kCsv:
      fmt::print("{}\n", csv_line(record));
      break;
  }
  if (options_.output != Output::kText && std::fflush(stdout) != 0) {
    return fmt::format("standard output: {}", std::strerror(errno));
  }
  if (!record.offset_known) return std::nullopt;
  if (record.telemetry.locked && record.telemetry.verdict == SampleVerdict::kUsed) {
    since_lock_.add(record);
  }
  report_text(record, sync_interval);
  return std::nullopt;
}

void ClockFollower::report_text(const SampleRecord& record, std::optional<Duration> sync_interval) {
  const std::uint64_t per_summary = samples_per_summary(sync_interval);
  if (per_summary < 2 || record.telemetry.verdict != SampleVerdict::kUsed) {
    log_(LogLevel::kInfo, "{}", ptp4l_line(record));
    return;
  }
  recent_.add(record);
  if (recent_.count() < per_summary) return;
  log_(LogLevel::kInfo, "{}", recent_.text());
  recent_.reset();
}

// As ptp4l: 2^(summary_interval - logSyncInterval) samples.
std::uint64_t ClockFollower::samples_per_summary(std::optional<Duration> sync_interval) const {
  if (!sync_interval || *sync_interval <= Duration{}) return 1;
  const double samples = std::exp2(options_.summary_interval) / sync_interval->seconds();
  return samples < 2.0 ? 1 : static_cast<std::uint64_t>(std::llround(samples));
}

void ClockFollower::log_summary() {
  state_.save();
  const DisciplineCounters& counters = discipline_.counters();
  log_(LogLevel::kNotice, "summary: {}, {} samples used, {} rejected, {} steps",
       locked() ? "locked" : "not locked", counters.used, counters.rejected, counters.steps);
  if (since_lock_.count() > 0) {
    log_(LogLevel::kNotice, "summary while locked: {}", since_lock_.text());
  }
}

}  // namespace ftcs::app
