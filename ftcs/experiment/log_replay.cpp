// SPDX-License-Identifier: MIT
#include "ftcs/experiment/log_replay.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "ftcs/analysis/statistics.h"
#include "ftcs/clock/virtual_clock.h"
#include "ftcs/sim/settable_source.h"

namespace ftcs::experiment {
namespace {

/// A replay cannot harm a clock; a limit that binds would compare limits instead of servos.
constexpr double kRateLimitPpb = 1e8;

class Replay {
 public:
  Replay(const RecordedLog& log, std::string name, const DisciplineConfig& config)
      : log_(log),
        clock_(source_, {first(), LocalTime{first().since_epoch()}, Rate{},
                         RateLimits::symmetric_ppb(kRateLimitPpb)}),
        discipline_(config, clock_) {
    result_.servo = std::move(name);
  }

  ReplayResult run() {
    for (std::size_t i = 0; i < log_.pairs.size(); ++i) {
      const RecordedPair& entry = log_.pairs[i];
      source_.set(entry.pair.free_running);
      measure(entry, i >= log_.pairs.size() / 2);
      const Telemetry telemetry = discipline_.on_pair(entry.pair);
      if (telemetry.commanded && i >= log_.pairs.size() / 2)
        rates_.add(telemetry.tracking_rate.ppb());
    }
    result_.samples = offsets_.count();
    result_.rms_offset_ns = offsets_.rms();
    result_.max_offset_ns = offsets_.max_absolute();
    result_.rms_time_error_ns = errors_.rms();
    result_.max_time_error_ns = errors_.max_absolute();
    result_.rate_spread_ppb = rates_.standard_deviation();
    result_.commands = discipline_.counters().commands;
    result_.steps = discipline_.counters().steps;
    result_.rejected = discipline_.counters().rejected;
    return std::move(result_);
  }

 private:
  [[nodiscard]] FreeRunningTime first() const { return log_.pairs.front().pair.free_running; }

  void measure(const RecordedPair& entry, bool counted) {
    const LocalTime local = clock_.local_at(entry.pair.free_running);
    if (entry.truth_ns && counted) {
      // Local minus reference = local minus free running, plus free running minus reference.
      const Duration steered = local.since_epoch() - entry.pair.free_running.since_epoch();
      errors_.add(steered.ns() + *entry.truth_ns);
    }
    const double offset_ns = offset_from_reference(local, entry.pair.reference).ns();
    if (!log_.two_way) return record(entry, offset_ns, counted);
    if (entry.pair.direction == Direction::kForward) {
      forward_ns_ = offset_ns;
    } else if (forward_ns_) {
      // Half of (t2 - t1) - (t4 - t3): the same for every servo, whatever delay it believes in.
      record(entry, 0.5 * (*forward_ns_ + offset_ns), counted);
      forward_ns_.reset();
    }
  }

  void record(const RecordedPair& entry, double offset_ns, bool counted) {
    result_.time_s.push_back((entry.pair.reference - log_.pairs.front().pair.reference).seconds());
    result_.offset_ns.push_back(offset_ns);
    if (counted) offsets_.add(offset_ns);
  }

  const RecordedLog& log_;
  sim::SettableSource source_;
  VirtualClock clock_;
  ClockDiscipline discipline_;
  std::optional<double> forward_ns_;
  RunningStatistics offsets_;
  RunningStatistics errors_;
  RunningStatistics rates_;
  ReplayResult result_;
};

DisciplineConfig config_for(ServoKind kind, const RecordedLog& log) {
  DisciplineConfig config;
  config.servo.kind = kind;
  config.servo.sync_interval = Nanoseconds{Duration::from_ns(log.interval_s * 1e9).rounded_ns()};
  config.servo.limits = RateLimits::symmetric_ppb(kRateLimitPpb);
  if (!log.two_way) config.servo.two_way.fixed_path_delay = Nanoseconds{0};
  config.step.mode = StepMode::kFirst;
  config.servo.adaptive.steering.first_step_allowed = true;
  return config;
}

}  // namespace

std::vector<ReplayResult> replay_log(const RecordedLog& log) {
  std::vector<ReplayResult> results;
  for (const ServoKindName& entry : kServoKinds) {
    results.push_back(Replay(log, std::string(entry.name), config_for(entry.kind, log)).run());
  }
  std::stable_sort(results.begin(), results.end(),
                   [&](const ReplayResult& a, const ReplayResult& b) {
                     return log.has_truth ? a.rms_time_error_ns < b.rms_time_error_ns
                                          : a.rms_offset_ns < b.rms_offset_ns;
                   });
  return results;
}

}  // namespace ftcs::experiment
