// SPDX-License-Identifier: MIT
#include "ftcs/experiment/log_replay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "ftcs/analysis/statistics.h"
#include "ftcs/clock/virtual_clock.h"
#include "ftcs/sim/settable_source.h"
#include "ftcs/time/relabel.h"

namespace ftcs::experiment {
namespace {

/// A replay cannot harm a clock; a limit that binds would compare limits instead of servos.
constexpr double kRateLimitPpb = 1e8;

/// What is known of a steered clock at one message, before it acts on it.
struct ClockState {
  LocalTime local;
  double sigma_ns = kNoFigure;
};

/// Figures of one clock over a record: the same for a servo and for the clock as recorded.
class ReplayJudge {
 public:
  ReplayJudge(const RecordedLog& log, std::string name) : log_(log) {
    result_.servo = std::move(name);
  }

  /// True error (local minus reference) at this message, ns; not a number if the record does not
  /// tell.
  [[nodiscard]] static double true_error_ns(const RecordedPair& entry, LocalTime local) {
    if (!entry.truth_ns) return kNoFigure;
    // Local minus reference = local minus free running, plus free running minus reference.
    return (local.since_epoch() - entry.pair.free_running.since_epoch()).ns() + *entry.truth_ns;
  }

  void measure(std::size_t index, const ClockState& clock) {
    const RecordedPair& entry = log_.pairs[index];
    const double offset_ns = offset_from_reference(clock.local, entry.pair.reference).ns();
    const double error_ns = true_error_ns(entry, clock.local);
    if (is_counted(index) && std::isfinite(error_ns)) errors_.push_back(error_ns);
    if (!log_.two_way) return record(index, clock, offset_ns, error_ns);
    if (entry.pair.direction == Direction::kForward) {
      forward_ns_ = offset_ns;
    } else if (forward_ns_) {
      // Half of (t2 - t1) - (t4 - t3): the same for every servo, whatever delay it believes in.
      record(index, clock, 0.5 * (*forward_ns_ + offset_ns), error_ns);
      forward_ns_.reset();
    }
  }

  void judge_deviation(std::size_t index, double estimate_ns, double error_ns, double sigma_ns) {
    if (!is_counted(index) || !std::isfinite(error_ns) || !(sigma_ns > 0.0)) return;
    const double miss = std::abs(estimate_ns - error_ns);
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      if (miss <= static_cast<double>(i + 1) * sigma_ns) ++inside_[i];
    }
    ++judged_;
  }

  void add_rate(std::size_t index, Rate rate) {
    if (is_counted(index)) rates_.add(rate.ppb());
  }

  [[nodiscard]] ReplayResult result() {
    const Summary offsets = summarize(offsets_);
    const Summary errors = summarize(errors_);
    result_.samples = offsets.moments.count();
    result_.rms_offset_ns = offsets.moments.rms();
    result_.max_offset_ns = offsets.moments.max_absolute();
    result_.rms_time_error_ns = errors.moments.rms();
    result_.max_time_error_ns = errors.moments.max_absolute();
    std::vector<double> sizes = log_.has_truth ? errors_ : offsets_;
    for (double& size : sizes) size = std::abs(size);
    std::sort(sizes.begin(), sizes.end());
    result_.median_ns = quantile_of_sorted(sizes, 0.5);
    result_.percentile_95_ns = quantile_of_sorted(sizes, 0.95);
    for (std::size_t i = 0; i < inside_.size(); ++i)
      result_.within_sigma[i] = judged_ > 0.0 ? inside_[i] / judged_ : kNoFigure;
    result_.rate_spread_ppb = rates_.standard_deviation();
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool is_counted(std::size_t index) const { return index >= log_.pairs.size() / 2; }

  void record(std::size_t index, const ClockState& clock, double offset_ns, double error_ns) {
    const Duration time = log_.pairs[index].pair.reference - log_.pairs.front().pair.reference;
    result_.time_s.push_back(time.seconds());
    result_.offset_ns.push_back(offset_ns);
    result_.time_error_ns.push_back(error_ns);
    result_.sigma_ns.push_back(clock.sigma_ns);
    if (is_counted(index)) offsets_.push_back(offset_ns);
  }

  const RecordedLog& log_;
  std::optional<double> forward_ns_;
  std::vector<double> offsets_;
  std::vector<double> errors_;
  std::array<double, 3> inside_{};
  double judged_ = 0.0;
  RunningStatistics rates_;
  ReplayResult result_;
};

class Replay {
 public:
  Replay(const RecordedLog& log, std::string name, const DisciplineConfig& config)
      : log_(log),
        clock_(source_, {first(), relabel<LocalTime>(first()), Rate{},
                         RateLimits::symmetric_ppb(kRateLimitPpb)}),
        discipline_(config, clock_),
        judge_(log, std::move(name)) {}

  ReplayResult run() {
    double sigma_ns = kNoFigure;
    for (std::size_t i = 0; i < log_.pairs.size(); ++i) {
      const RecordedPair& entry = log_.pairs[i];
      source_.set(entry.pair.free_running);
      const LocalTime local = clock_.local_at(entry.pair.free_running);
      judge_.measure(i, {local, sigma_ns});
      const Telemetry telemetry = discipline_.on_pair(entry.pair);
      sigma_ns = telemetry.servo.offset_sigma_ns;
      judge_.judge_deviation(i, telemetry.servo.offset.ns(),
                             ReplayJudge::true_error_ns(entry, local), sigma_ns);
      if (telemetry.commanded) judge_.add_rate(i, telemetry.tracking_rate);
    }
    ReplayResult result = judge_.result();
    result.commands = discipline_.counters().commands;
    result.steps = discipline_.counters().steps;
    result.rejected = discipline_.counters().rejected;
    return result;
  }

 private:
  [[nodiscard]] FreeRunningTime first() const { return log_.pairs.front().pair.free_running; }

  const RecordedLog& log_;
  sim::SettableSource source_;
  VirtualClock clock_;
  ClockDiscipline discipline_;
  ReplayJudge judge_;
};

/// Of summaries: magnitudes of the second half.
ReplayResult as_summarized(const RecordedLog& log) {
  ReplayResult result;
  result.servo = kAsRecorded;
  result.rms_time_error_ns = result.max_time_error_ns = kNoFigure;
  result.median_ns = result.percentile_95_ns = kNoFigure;
  result.within_sigma.fill(kNoFigure);
  result.rate_spread_ppb = kNoFigure;
  RunningStatistics sizes;
  for (std::size_t i = log.summaries.size() / 2; i < log.summaries.size(); ++i) {
    sizes.add(log.summaries[i].rms_ns);
    result.max_offset_ns = std::max(result.max_offset_ns, log.summaries[i].max_ns);
  }
  result.samples = sizes.count();
  result.rms_offset_ns = sizes.rms();
  return result;
}

/// The recorded clock itself: nothing is known of its servo's commands.
ReplayResult as_recorded(const RecordedLog& log) {
  if (!log.summaries.empty()) return as_summarized(log);
  ReplayJudge judge(log, kAsRecorded);
  for (std::size_t i = 0; i < log.pairs.size(); ++i) {
    const RecordedPair& entry = log.pairs[i];
    const Duration local =
        entry.pair.free_running.since_epoch() + Duration::from_ns(entry.steering_ns);
    judge.measure(i, {LocalTime{local}, kNoFigure});
  }
  return judge.result();
}

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

std::vector<std::string> replay_servo_names() {
  std::vector<std::string> names;
  for (const ServoKindName& entry : kServoKinds) names.emplace_back(entry.name);
  return names;
}

std::vector<ReplayResult> replay_log(
    const RecordedLog& log, const std::vector<std::string>& servos,
    const std::vector<std::shared_ptr<const ServoLibrary>>& libraries) {
  std::vector<ReplayResult> results;
  const bool all = servos.empty() && libraries.empty();
  for (const ServoKindName& entry : kServoKinds) {
    const bool wanted = all || std::find(servos.begin(), servos.end(), entry.name) != servos.end();
    if (wanted)
      results.push_back(Replay(log, std::string(entry.name), config_for(entry.kind, log)).run());
  }
  for (const auto& library : libraries) {
    DisciplineConfig config = config_for(ServoKind::kExternal, log);
    const ServoInstance instance(*library, config.servo);
    config.servo.external = instance.config();
    results.push_back(Replay(log, library->name(), config).run());
  }
  if (log.steered) results.push_back(as_recorded(log));
  std::stable_sort(results.begin(), results.end(),
                   [&](const ReplayResult& a, const ReplayResult& b) {
                     return log.has_truth ? a.rms_time_error_ns < b.rms_time_error_ns
                                          : a.rms_offset_ns < b.rms_offset_ns;
                   });
  return results;
}

}  // namespace ftcs::experiment
