// SPDX-License-Identifier: MIT
#include "apps/ftcs/ptp_receiver.h"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>
#include <variant>

#include "apps/ftcs/commands.h"

namespace ftcs::app {
namespace {

// A slew over more than this would take long enough to look like a fault: the user must ask for a
// step.
constexpr Nanoseconds kLargestFirstOffset{1'000'000'000};

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
  config.delay_asymmetry = options.delay_asymmetry;
  config.seed = seed;
  return config;
}

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

DisciplineConfig discipline_config(const PtpOptions& options, bool hardware_stamps) {
  DisciplineConfig config;
  config.servo = options.servo;
  config.servo.linuxptp_pi.first_step_threshold = options.first_step_threshold;
  config.servo.linuxptp_pi.step_threshold = options.step_threshold;
  config.servo.linuxptp_pi.timestamping =
      hardware_stamps ? TimestampingKind::kHardware : TimestampingKind::kSoftware;
  config.step = step_policy(options);
  config.largest_first_offset = kLargestFirstOffset;
  return config;
}

}  // namespace

PtpReceiver::PtpReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                         std::unique_ptr<platform::TimestampClock> timestamps,
                         const ptp::PortIdentity& identity)
    : PtpCorePort(kernel, options, log, std::move(timestamps),
                  core_config(options, identity,
                              static_cast<std::uint64_t>(kernel.clock_ns(CLOCK_MONOTONIC_RAW)))),
      discipline_(discipline_config(options, has_hardware_stamps()), clock()) {}

ptp::ActionList PtpReceiver::start(FreeRunningTime now) {
  if (options().output == Output::kCsv) fmt::print("{}\n", csv_header());
  return PtpCorePort::start(now);
}

void PtpReceiver::act(const ptp::Action& action) {
  if (const auto* emitted = std::get_if<ptp::EmitPair>(&action)) {
    on_pair(emitted->pair);
  } else if (const auto* seen = std::get_if<ptp::TransmitterSeen>(&action)) {
    log()(LogLevel::kNotice, "port 1 ({}): new foreign master {}", options().interface,
          to_text(seen->port).view());
  } else if (const auto* selected = std::get_if<ptp::TransmitterSelected>(&action)) {
    on_selected(*selected);
  } else if (const auto* jumped = std::get_if<ptp::ReferenceJumped>(&action)) {
    log()(LogLevel::kWarning, "port 1 ({}): the reference jumped by {:.9f} s; starting anew",
          options().interface, jumped->jump.seconds());
    discipline_.on_new_reference();
  }
}

void PtpReceiver::on_selected(const ptp::TransmitterSelected& selected) {
  if (!selected.changed) return;
  log()(LogLevel::kNotice, "selected best master clock {}",
        to_text(selected.transmitter.announce.grandmaster).view());
  if ((selected.transmitter.flags & ptp::flag::kPtpTimescale) == 0) {
    log()(LogLevel::kNotice, "foreign master not using PTP timescale");
  }
  if (had_transmitter_) discipline_.on_new_reference();
  had_transmitter_ = true;
}

void PtpReceiver::on_pair(const EventPair& pair) {
  const LocalTime local = clock().local_at(pair.free_running);
  const Telemetry telemetry = discipline_.on_pair(pair);
  if (telemetry.offset_refused) {
    return fail(
        fmt::format("the first offset is {:.3f} s, more than {} s: set the clock near the "
                    "reference (--offset) or allow one step (--first-step)",
                    telemetry.servo.offset.seconds(), kLargestFirstOffset.count() / 1e9));
  }
  if (pair.direction == Direction::kForward) {
    SampleRecord record;
    record.time_s = seconds_since_start();
    record.offset_known = telemetry.servo.offset_known;
    record.offset = telemetry.verdict == SampleVerdict::kUsed
                        ? telemetry.servo.offset
                        : offset_from_reference(local, pair.reference + telemetry.servo.path_delay);
    record.telemetry = telemetry;
    report(record);
  }
  follow_lock(telemetry.locked);
}

void PtpReceiver::report(const SampleRecord& record) {
  switch (options().output) {
    case Output::kText:
      break;
    case Output::kJson:
      fmt::print("{}\n", json_line(record));
      break;
    case Output::kCsv:
      fmt::print("{}\n", csv_line(record));
      break;
  }
  if (options().output != Output::kText && std::fflush(stdout) != 0) {
    return fail(fmt::format("standard output: {}", std::strerror(errno)));
  }
  if (!record.offset_known) return;
  if (record.telemetry.locked && record.telemetry.verdict == SampleVerdict::kUsed) {
    since_lock_.add(record);
  }
  report_text(record);
}

void PtpReceiver::report_text(const SampleRecord& record) {
  const std::uint64_t per_summary = samples_per_summary();
  if (per_summary < 2 || record.telemetry.verdict != SampleVerdict::kUsed) {
    log()(LogLevel::kInfo, "{}", ptp4l_line(record));
    return;
  }
  recent_.add(record);
  if (recent_.count() < per_summary) return;
  log()(LogLevel::kInfo, "{}", recent_.text());
  recent_.reset();
}

// As ptp4l: 2^(summary_interval - logSyncInterval) samples.
std::uint64_t PtpReceiver::samples_per_summary() const {
  const auto interval = core().sync_interval();
  if (!interval || *interval <= Duration{}) return 1;
  const double samples = std::exp2(options().summary_interval) / interval->seconds();
  return samples < 2.0 ? 1 : static_cast<std::uint64_t>(samples);
}

// From the port's state and not from a change of the lock: after a fault shorter than the lock's
// patience the port comes back uncalibrated while the clock has been locked all along.
void PtpReceiver::follow_lock(bool locked) {
  if (locked && core().state() == ptp::PortState::kUncalibrated) {
    perform(core().on_servo_locked(now()));
  } else if (!locked && core().state() == ptp::PortState::kTimeReceiver) {
    perform(core().on_servo_unlocked(now()));
  }
}

void PtpReceiver::housekeeping(FreeRunningTime) {
  const Telemetry telemetry = discipline_.on_silence();
  const bool holdover = telemetry.servo.state == ServoState::kHoldover;
  if (holdover && !in_holdover_) {
    log()(LogLevel::kWarning, "port 1 ({}): no Sync for a while; keeping the last rate (holdover)",
          options().interface);
  }
  in_holdover_ = holdover;
  if (!telemetry.locked) follow_lock(false);  // only a sample can say that it is locked again
}

int PtpReceiver::finish() {
  const DisciplineCounters& counters = discipline_.counters();
  const bool locked = discipline_.locked();
  log()(LogLevel::kNotice, "summary: {}, {} samples used, {} rejected, {} steps",
        locked ? "locked" : "not locked", counters.used, counters.rejected, counters.steps);
  if (since_lock_.count() > 0) {
    log()(LogLevel::kNotice, "summary while locked: {}", since_lock_.text());
  }
  log_unusual(core().counters());
  return locked ? kSuccess : kNotLocked;
}

}  // namespace ftcs::app
