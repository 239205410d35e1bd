// SPDX-License-Identifier: MIT
#include "ftcs/daemon/follower_record.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <utility>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/real_clock.h"
#include "ftcs/daemon/watch/follower_watch.h"

namespace ftcs::daemon {
namespace {

// A slew over more than this would take long enough to look like a fault: the user must ask for a
// step.
constexpr Nanoseconds kLargestOffset{1'000'000'000};
/// A UTC offset that is put right moves the reference by a second to the nanosecond, seen with
/// noise.
constexpr Nanoseconds kNoiseOfASecond{1'000'000};
constexpr Nanoseconds kLargestMeasured = kLargestOffset + kNoiseOfASecond;
constexpr std::size_t kKeptRefusals = 8;

StepPolicy step_policy(const PtpOptions& options) {
  // ptp4l's servo keeps ptp4l's thresholds; all others are continuous unless a first step is asked
  // for.
  if (options.follower.servo.kind == ServoKind::kLinuxptpPi) {
    if (options.follower.step_threshold > Nanoseconds{0})
      return {StepMode::kAlways, options.follower.step_threshold};
    if (options.follower.first_step_threshold > Nanoseconds{0}) {
      return {StepMode::kFirst, options.follower.first_step_threshold};
    }
    return {};
  }
  if (!options.follower.first_step) return {};
  return {StepMode::kFirst, options.follower.first_step_threshold};
}

/// Empty, with a notice, where the servo has nothing to keep.
std::string driftfile(const PtpOptions& options, Log& log) {
  if (options.follower.driftfile.empty() || options.follower.servo.kind == ServoKind::kAdaptive)
    return options.follower.driftfile;
  log(LogLevel::kNotice, "driftfile {}: not used, the servo {} keeps no state",
      options.follower.driftfile, servo_kind_name(options.follower.servo.kind));
  return {};
}

/// What makes a learnt rate another clock's.
std::string clock_name(const PtpOptions& options, bool hardware_stamps) {
  const char* steered = options.clock.kind == ClockKind::kVirtual  ? "virtual"
                        : options.clock.kind == ClockKind::kSystem ? "system"
                                                                   : "phc";
  return fmt::format("{}, {} clock, {} timestamps, skew {} ppb", options.interface, steered,
                     hardware_stamps ? "hardware" : "software", options.clock.skew_ppb);
}

std::string holdover_text(const node::Note& note) {
  return note.refused_syncs == 0 ? "no Sync"
                                 : fmt::format("{} Syncs refused, no good one", note.refused_syncs);
}

std::string plan_text(const JumpPlan& plan) {
  switch (plan.response) {
    case JumpResponse::kSlewed:
      return fmt::format("starting anew; slewing the clock there takes {:.1f} s",
                         plan.slew.seconds());
    case JumpResponse::kStepped:
      return "starting anew; the clock is stepped there";
    case JumpResponse::kRefused:
      break;
  }
  return fmt::format("more than {} s is refused (--first-step allows a step)",
                     kLargestOffset.count() / 1e9);
}

/// Every limit that stands in the way: with one of them lifted the next would be met.
std::string jump_text(const node::Note& note, const StepPolicy& step) {
  if (!note.gated) return plan_text(note.plan);
  const bool far = abs(note.jump) > Duration{kLargestMeasured};
  std::string text = "not followed (--max-change)";
  if (far && !step.permits(true)) text += ", and " + plan_text({JumpResponse::kRefused, {}});
  return text;
}

std::string foreign_text(const node::Note& note) {
  return fmt::format("the transmitter's peer delay messages are {:.0f} ns off its Syncs",
                     note.difference_ns);
}

}  // namespace

StateKeeper state_keeper(const PtpOptions& options, Log& log, bool hardware_stamps) {
  return {log, driftfile(options, log), options.follower.driftfile_interval,
          clock_name(options, hardware_stamps)};
}

node::ClockFollowerConfig follower_config(const PtpOptions& options, bool hardware_stamps,
                                          const std::optional<LearntState>& learnt) {
  node::ClockFollowerConfig follower;
  DisciplineConfig& config = follower.discipline;
  config.servo = options.follower.servo;
  config.servo.linuxptp_pi.first_step_threshold = options.follower.first_step_threshold;
  config.servo.linuxptp_pi.step_threshold = options.follower.step_threshold;
  config.servo.linuxptp_pi.timestamping =
      hardware_stamps ? TimestampingKind::kHardware : TimestampingKind::kSoftware;
  config.servo.adaptive.steering.first_step_allowed = options.follower.first_step;
  config.servo.adaptive.learnt = learnt;
  config.step = step_policy(options);
  config.largest_offset = kLargestMeasured;
  config.largest_rate_change = options.follower.steering.largest_rate_change;
  follower.peer_to_peer = options.protocol.peer_to_peer();
  follower.filter_is_chosen = options.follower.filter_is_chosen;
  follower.largest_path_delay = options.follower.max_path_delay;
  return follower;
}

FollowerRecord::FollowerRecord(const PtpOptions& options, Log& log, StateKeeper& state,
                               const ClockDiscipline& discipline, FreeRunningTime start,
                               std::string label)
    : options_(options),
      log_(log),
      state_(state),
      discipline_(discipline),
      start_(start),
      label_(std::move(label)) {}

void FollowerRecord::begin() {
  std::fflush(stdout);  // from here on lines go by the writer
  if (options_.output == Output::kCsv) samples_.write(csv_header() + "\n");
  watch_output();
}

void FollowerRecord::add(const node::Steered& steered, FreeRunningTime now,
                         std::optional<Duration> sync_interval) {
  const Telemetry& telemetry = steered.telemetry;
  const bool used = telemetry.verdict == SampleVerdict::kUsed;
  const double time_s = (now - start_).seconds();
  if (!used) keep_refusal(steered, time_s);
  if (!steered.paces) return;
  if (telemetry.direction == Direction::kForward) add_sync(steered, time_s, sync_interval);
  follow_lock(now);
  if (used && telemetry.locked) state_.note(telemetry.servo, now);
}

void FollowerRecord::add_sync(const node::Steered& steered, double time_s,
                              std::optional<Duration> sync_interval) {
  const Telemetry& telemetry = steered.telemetry;
  const bool used = telemetry.verdict == SampleVerdict::kUsed;
  SampleRecord record;
  record.time_s = time_s;
  record.offset_known = telemetry.servo.offset_known;
  record.offset = used ? telemetry.servo.offset : steered.perceived;
  record.telemetry = telemetry;
  if (used) {
    status_.last = record;
    status_.has_sample = true;
    status_.last_local = steered.local;
    last_used_ = steered.event;
  }
  if (watch_ != nullptr && record.offset_known) watch_->add(watch_point(record));
  report(record, sync_interval);
}

// Of a clock that refuses, what may pass is a warning; what will not ends the run.
std::optional<std::string> FollowerRecord::add(const node::Note& note) {
  using node::NoteKind;
  switch (note.kind) {
    case NoteKind::kStampsShared:
      log_(LogLevel::kInfo, "{}: the transmitter's peer delay messages measure time too", label_);
      break;
    case NoteKind::kStampsForeign:
      log_(LogLevel::kInfo, "{}: {}; the link delay alone counts", label_, foreign_text(note));
      break;
    case NoteKind::kStampsDeparted:
      log_(LogLevel::kWarning, "{}: {}; starting anew with the link delay", label_,
           foreign_text(note));
      break;
    case NoteKind::kNeighbourIsAnother:
      log_(LogLevel::kWarning,
           "{}: the neighbour is not the transmitter any more; starting anew with the link delay",
           label_);
      break;
    case NoteKind::kAnotherLink:
      log_(LogLevel::kWarning, "{}: another link; starting anew with the link delay", label_);
      break;
    case NoteKind::kHoldover:
      log_(LogLevel::kWarning, "{}: {} for a while; keeping the last rate (holdover)", label_,
           holdover_text(note));
      break;
    case NoteKind::kReferenceJumped:
      log_(LogLevel::kWarning, "{}: the reference jumped by {:+.9f} s: {}", label_,
           note.jump.seconds(), jump_text(note, step_policy(options_)));
      break;
    case NoteKind::kOffsetRefused:
      log_(LogLevel::kWarning,
           "{}: the offset is {:.3f} s, more than {} s: not followed, {} in a row; set the clock "
           "near the reference{} or allow one step (--first-step)",
           label_, note.offset.seconds(), kLargestOffset.count() / 1e9, note.times,
           options_.clock.kind == ClockKind::kVirtual ? " (--offset, 37s if it shows TAI)" : "");
      break;
    case NoteKind::kPathDelayRefused:
      log_(LogLevel::kWarning,
           "{}: the path delay is {:.0f} ns, more than --max-path-delay {} ns: not followed, {} "
           "messages in a row",
           label_, note.path_delay.ns(), options_.follower.max_path_delay.count(), note.times);
      break;
    case NoteKind::kSaturated:
      log_(LogLevel::kWarning,
           "{}: the clock runs at its limit, {:+.0f} ppb, for {} samples; {:.6f} s are left "
           "(--max-frequency)",
           label_, discipline_.latest().applied_rate.ppb(), note.times, note.offset.seconds());
      break;
    case NoteKind::kClockRefused:
      if (node::is_lasting(note.error)) return describe("the clock", note.error);
      log_(LogLevel::kWarning, "{}: {}", label_, describe("the clock", note.error));
      break;
  }
  return std::nullopt;
}

void FollowerRecord::follow_lock(FreeRunningTime now) {
  if (!locked()) {
    locked_since_.reset();
  } else if (!locked_since_) {
    locked_since_ = now;
  }
}

void FollowerRecord::keep_refusal(const node::Steered& steered, double time_s) {
  const Telemetry& telemetry = steered.telemetry;
  const bool known = telemetry.direction == Direction::kForward && telemetry.servo.offset_known;
  status_.refusals.push_back({time_s, telemetry.direction, telemetry.verdict,
                              known ? std::optional(steered.perceived.ns()) : std::nullopt});
  if (status_.refusals.size() > kKeptRefusals) status_.refusals.pop_front();
}

FollowerRecord::Status FollowerRecord::status(FreeRunningTime now) const {
  Status status = status_;
  if (status.has_sample) status.last_age_s = (now - last_used_).seconds();
  if (locked_since_) status.locked_for_s = (now - *locked_since_).seconds();
  status.since_lock = summary_.since_lock();
  return status;
}

void FollowerRecord::report(const SampleRecord& record, std::optional<Duration> sync_interval) {
  switch (options_.output) {
    case Output::kText:
      break;
    case Output::kJson:
      samples_.write(json_line(record) + "\n");
      break;
    case Output::kCsv:
      samples_.write(csv_line(record) + "\n");
      break;
  }
  watch_output();
  if (!record.offset_known) return;
  summary_.add(record);
  report_text(record, sync_interval);
}

// A reader that goes away, such as head, ends nothing that keeps a clock.
void FollowerRecord::watch_output() {
  if (samples_.error() != 0 && !std::exchange(output_failed_, true)) {
    log_(LogLevel::kWarning, "standard output: {}; samples are lost, the clock is steered on",
         platform::write_failure(samples_.error()));
  }
  samples_lost_ += samples_.take_lost();
  if (samples_lost_ < 2 * samples_lost_told_ || samples_lost_ == 0) return;
  tell_lost_samples();
}

// The first, then each time that they have doubled, and all at the end: a slow reader floods no
// log.
void FollowerRecord::tell_lost_samples() {
  if (samples_lost_ == samples_lost_told_) return;
  log_(LogLevel::kWarning, "standard output: {} samples lost so far, nobody reads them in time",
       samples_lost_);
  samples_lost_told_ = samples_lost_;
}

int FollowerRecord::exit_code() const {
  if (samples_.error() != 0 && samples_.error() != EPIPE) return kRuntimeError;
  return locked() ? kSuccess : kNotLocked;
}

void FollowerRecord::report_text(const SampleRecord& record,
                                 std::optional<Duration> sync_interval) {
  const std::uint64_t per_summary = samples_per_summary(sync_interval);
  const auto tell = [&](const std::string& line) {
    if (!has_room_for_line(record.time_s)) return;
    if (const auto left_out = std::exchange(lines_left_out_, 0); left_out > 0) {
      log_(LogLevel::kInfo, "{} lines of samples left out", left_out);
    }
    log_(LogLevel::kInfo, "{}", line);
  };
  if (per_summary < 2 || record.telemetry.verdict != SampleVerdict::kUsed) {
    return tell(ptp4l_line(record));
  }
  if (const auto text = summary_.add_recent(record, per_summary)) tell(*text);
}

// Who floods us with Syncs floods no log: as many lines a second as summary_interval asks for, or a
// few.
bool FollowerRecord::has_room_for_line(double time_s) {
  constexpr double kFew = 4.0;
  const double a_second = std::max(kFew, std::exp2(-options_.summary_interval));
  const double passed = time_s - std::exchange(line_room_at_s_, time_s);
  line_room_ = std::min(4.0 * a_second, line_room_ + passed * a_second);
  if (line_room_ < 1.0) {
    ++lines_left_out_;
    return false;
  }
  line_room_ -= 1.0;
  return true;
}

// As ptp4l: 2^(summary_interval - logSyncInterval) samples.
std::uint64_t FollowerRecord::samples_per_summary(std::optional<Duration> sync_interval) const {
  if (!sync_interval || *sync_interval <= Duration{}) return 1;
  const double samples = std::exp2(options_.summary_interval) / sync_interval->seconds();
  return samples < 2.0 ? 1 : static_cast<std::uint64_t>(std::llround(samples));
}

void FollowerRecord::log_summary() {
  state_.save();
  tell_lost_samples();
  summary_.log(log_, discipline_.counters(), locked(), "samples");
}

}  // namespace ftcs::daemon
