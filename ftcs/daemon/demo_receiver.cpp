// SPDX-License-Identifier: MIT
#include "ftcs/daemon/demo_receiver.h"

#include <utility>
#include <variant>

#include "ftcs/analysis/statistics.h"
#include "ftcs/daemon/exit_code.h"
#include "ftcs/ptp/interval.h"

namespace ftcs::daemon {
namespace {

/// Sync messages of a real system do not arrive on the dot. With T_c = T_sync one that is early by
/// a part of the interval finds that part of the offset still there; eq. (17) with T_c a little
/// shorter has it gone in time.
constexpr double kCorrectionPart = 0.8;

/// The command line admits -7 to 0 only, all of which are intervals.
Duration sync_interval(const DemoOptions& demo) {
  return ptp::interval_from_log(demo.log_sync_interval).value_or(Duration{});
}

std::vector<ServoConfig> demo_servos(const DemoOptions& demo, Nanoseconds interval) {
  std::vector<ServoConfig> servos;
  for (const ServoKind kind :
       {ServoKind::kAdaptive, ServoKind::kFtcs, ServoKind::kPics, ServoKind::kLinuxptpPi}) {
    ServoConfig config;
    config.kind = kind;
    config.sync_interval = interval;
    config.limits = RateLimits::symmetric_ppb(demo.max_frequency_ppb);
    config.ftcs.correction_time = Nanoseconds{
        static_cast<std::int64_t>(static_cast<double>(interval.count()) * kCorrectionPart)};
    config.linuxptp_pi.first_step_threshold = Nanoseconds{0};  // nobody steps here
    servos.push_back(config);
  }
  return servos;
}

ptp::TimeReceiverConfig receiver_config(const PtpOptions& options) {
  ptp::TimeReceiverConfig config;
  config.port = {*options.protocol.clock_identity, 1};
  config.domain = options.protocol.domain;
  config.log_announce_interval = options.protocol.log_announce_interval;
  config.log_min_delay_req_interval = options.protocol.log_min_delay_req_interval;
  return config;
}

}  // namespace

DemoReceiver::DemoReceiver(platform::Kernel& kernel, const PtpOptions& options,
                           const DemoOptions& demo, Log& log,
                           std::unique_ptr<platform::TimestampClock> timestamps,
                           platform::ChildProcess* transmitter)
    : PtpCorePort(kernel, options, log, std::move(timestamps), receiver_config(options)),
      demo_(demo),
      transmitter_(transmitter),
      truth_{Duration::from_whole_ns(options.clock.start->realtime_ns) -
             options.clock.start->free_running.since_epoch()},
      view_(demo.live_view) {
  const auto interval = Nanoseconds{sync_interval(demo).floor_ns()};
  VirtualClockConfig start;
  start.free_running = options.clock.start->free_running;
  start.local = LocalTime::from_ns(options.clock.start->realtime_ns) + demo.offset;
  start.limits = RateLimits::symmetric_ppb(demo.max_frequency_ppb);
  for (const ServoConfig& servo : demo_servos(demo, interval)) {
    DisciplineConfig discipline;
    discipline.servo = servo;
    trials_.push_back(std::make_unique<experiment::ServoTrial>(
        experiment::ServoTrial::Setup{std::string(servo_kind_name(servo.kind)), discipline, start,
                                      truth_},
        oscillator()));
  }
}

void DemoReceiver::act(const ptp::Action& action) {
  if (const auto* emitted = std::get_if<ptp::EmitPair>(&action)) on_pair(emitted->pair);
}

void DemoReceiver::on_pair(const EventPair& pair) {
  for (const auto& trial : trials_) trial->on_pair(pair);
  const ReferenceTime ours = truth_.at(oscillator().to_underlying(pair.free_running));
  if (pair.direction != Direction::kForward) {
    way_back_ns_.push_back((pair.reference - ours).ns());
    return;
  }
  one_way_ns_.push_back((ours - pair.reference).ns());
  draw();
}

void DemoReceiver::draw() {
  std::vector<const experiment::ServoTrial*> shown;
  for (const auto& trial : trials_) shown.push_back(trial.get());
  view_.draw(shown, seconds_since_start(), demo_.duration_s);
}

void DemoReceiver::housekeeping(FreeRunningTime) {
  if (transmitter_ == nullptr) return;
  if (transmitter_->ended()) fail("the time transmitter ended before the demonstration was over");
}

int DemoReceiver::finish() {
  view_.finish();
  if (one_way_ns_.empty()) {
    log()(LogLevel::kError, "no Sync message arrived on {} within {:.1f} s", options().interface,
          seconds_since_start());
    return kRuntimeError;
  }
  interrupted_ = seconds_since_start() < demo_.duration_s;
  if (interrupted_) {
    log()(LogLevel::kWarning, "stopped after {:.1f} of {:g} s; the figures cover that",
          seconds_since_start(), demo_.duration_s);
  }
  return kSuccess;
}

DemoResult DemoReceiver::result() const {
  constexpr double kSigmaPerMad = 1.4826;  // of a normal distribution
  constexpr double kBandInSigma = 5.0;
  const Summary one_way = summarize(one_way_ns_);
  DemoResult result;
  result.sync_interval_ns = sync_interval(demo_).ns();
  result.link_delay_ns = one_way.median;
  if (!way_back_ns_.empty()) {
    result.asymmetry_ns = (one_way.median - summarize(way_back_ns_).median) / 2;
  }
  result.lock_band_ns = kBandInSigma * kSigmaPerMad * one_way.median_absolute_deviation;
  result.samples = one_way_ns_.size();
  result.interrupted = interrupted_;
  for (const auto& trial : trials_) result.servos.push_back(trial->result(result.lock_band_ns));
  return result;
}

}  // namespace ftcs::daemon
