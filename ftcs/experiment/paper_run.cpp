// SPDX-License-Identifier: MIT
#include "ftcs/experiment/paper_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "ftcs/analysis/convergence.h"
#include "ftcs/analysis/statistics.h"
#include "ftcs/experiment/closed_form.h"
#include "ftcs/experiment/paper_check.h"

namespace ftcs::experiment {
namespace {

double cycles_or_never(const std::optional<std::uint64_t>& cycles) {
  return cycles ? static_cast<double>(*cycles) : std::numeric_limits<double>::infinity();
}

/// A whole servo where a control law is expected: forward messages alone, the path delay known to
/// be zero.
template <class Servo>
class ForwardOnly {
 public:
  template <class Config>
  explicit ForwardOnly(const Config& config) : servo_(std::make_unique<Servo>(config)) {}

  ServoUpdate update(const SyncSample& sample, const ClockReading& now) noexcept {
    return servo_->update({Direction::kForward, sample.origin, sample.local, sample.free_running},
                          now);
  }

 private:
  std::unique_ptr<Servo> servo_;  // kilobytes
};

ServoConfig common_config(const sim::OneWaySpec& world) {
  ServoConfig config;
  config.sync_interval = Nanoseconds{world.interval.rounded_ns()};
  config.limits = world.limits;
  config.two_way.fixed_path_delay = Nanoseconds{0};
  return config;
}

/// Runs the row's servo; `observe` sees every sample.
template <class Observer>
void run_row(const PaperRow& row, std::uint64_t seed, Observer observe) {
  if (const auto* ftcs = std::get_if<FtcsConfig>(&row.servo)) {
    FtcsServo law(*ftcs);
    sim::run_one_way(row.world, seed, law, observe);
  } else if (const auto* pics = std::get_if<PicsConfig>(&row.servo)) {
    PicsServo law(*pics);
    sim::run_one_way(row.world, seed, law, observe);
  } else if (const auto* adaptive = std::get_if<AdaptiveConfig>(&row.servo)) {
    ForwardOnly<AdaptiveServo> law(*adaptive);
    sim::run_one_way(row.world, seed, law, observe);
  } else {
    const ServoConfig common = common_config(row.world);
    const ServoInstance instance(*std::get<ExternalPaperServo>(row.servo).plugin, common);
    ExternalConfig config = instance.config();
    config.fixed_path_delay = common.two_way.fixed_path_delay;
    ForwardOnly<ExternalServo> law(config);
    sim::run_one_way(row.world, seed, law, observe);
  }
}

PaperSeedRun run_seed(const PaperTable& table, const PaperRow& row, std::uint64_t seed) {
  ConvergenceTracker tracker(table.converged_band_ns);
  RunningStatistics perceived;
  RunningStatistics truth;
  run_row(row, seed, [&](const sim::OneWaySample& sample) {
    tracker.add(sample.perceived_offset_ns, sample.acted);
    if (sample.index < table.measure_from) return;
    perceived.add(sample.perceived_offset_ns);
    truth.add(sample.time_error_ns);
  });
  const Convergence& convergence = tracker.result();
  PaperSeedRun run;
  run.done = true;
  run.rms_perceived_ns = perceived.rms();
  run.deviation_perceived_ns = perceived.standard_deviation();
  run.rms_true_ns = truth.rms();
  run.cycles = cycles_or_never(convergence.cycles_to_converge(ConvergenceOrigin::kFirstAction));
  run.cycles_from_first_message =
      cycles_or_never(convergence.cycles_to_converge(ConvergenceOrigin::kFirstMessage));
  return run;
}

PaperTrace trace_row(const PaperRow& row, std::uint64_t seed) {
  PaperTrace trace{row.key(), row.world.interval.ns(), {}, {}, {}};
  run_row(row, seed, [&](const sim::OneWaySample& sample) {
    trace.perceived_offset_ns.push_back(sample.perceived_offset_ns);
    trace.time_error_ns.push_back(sample.time_error_ns);
    trace.rate_ppm.push_back(sample.rate.ppm());
  });
  return trace;
}

double predicted_rms(const PaperRow& row) {
  if (const auto* ftcs = std::get_if<FtcsConfig>(&row.servo)) {
    // Inside the band the gain is offset_gain; a band that is unbounded makes eq. (19) hold
    // everywhere.
    return row.world.timestamp_noise_ns * std::sqrt(ftcs_noise_gain(ftcs->offset_gain).perceived);
  }
  if (!std::holds_alternative<PicsConfig>(row.servo))
    return kNotGiven;  // the adaptive servo's gain falls with time; another's is not known
  const auto& pics = std::get<PicsConfig>(row.servo);
  // The loop sees the oscillator's skew as a gain error: its additive steps are steps of the
  // oscillator's time.
  double gain = 1.0;
  for (const auto& part : row.world.oscillator.parts) {
    if (const auto* skew = std::get_if<sim::ConstantSkew>(&part)) gain += skew->deviation;
  }
  return row.world.timestamp_noise_ns *
         std::sqrt(
             pics_noise_gain(gain * pics.proportional_gain, gain * pics.integral_gain).perceived);
}

/// sqrt of the mean of squares.
double ensemble(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double v : values) squares += v * v;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

std::vector<double> sorted_figures(const std::vector<PaperSeedRun>& runs,
                                   double PaperSeedRun::*figure) {
  std::vector<double> values;
  for (const auto& run : runs) {
    if (run.done) values.push_back(run.*figure);
  }
  std::sort(values.begin(), values.end());
  return values;
}

void summarise(PaperRowResult& row) {
  const auto rms = sorted_figures(row.runs, &PaperSeedRun::rms_perceived_ns);
  const auto cycles = sorted_figures(row.runs, &PaperSeedRun::cycles);
  row.rms_perceived_ns = ensemble(rms);
  row.deviation_ns = ensemble(sorted_figures(row.runs, &PaperSeedRun::deviation_perceived_ns));
  row.rms_true_ns = ensemble(sorted_figures(row.runs, &PaperSeedRun::rms_true_ns));
  row.median_rms_ns = quantile_of_sorted(rms, 0.5);
  row.percentile_5_ns = quantile_of_sorted(rms, 0.05);
  row.percentile_95_ns = quantile_of_sorted(rms, 0.95);
  row.median_cycles = quantile_of_sorted(cycles, 0.5);
  row.percentile_5_cycles = quantile_of_sorted(cycles, 0.05);
  row.percentile_95_cycles = quantile_of_sorted(cycles, 0.95);
  row.median_cycles_from_first_message =
      quantile_of_sorted(sorted_figures(row.runs, &PaperSeedRun::cycles_from_first_message), 0.5);
}

}  // namespace

bool PaperResult::passed() const noexcept {
  return complete && std::all_of(checks.begin(), checks.end(),
                                 [](const PaperCheckResult& c) { return c.passed || !c.demanded; });
}

void add_servo(PaperTable& table, const std::shared_ptr<const ServoLibrary>& library) {
  std::vector<std::string> groups;
  const std::vector<PaperRow> rows = table.rows;
  for (const PaperRow& row : rows) {
    if (row.support || std::find(groups.begin(), groups.end(), row.group) != groups.end()) continue;
    groups.push_back(row.group);
    PaperRow added;
    added.name = library->name();
    added.group = row.group;
    added.world = row.world;
    added.servo = ExternalPaperServo{library};
    table.rows.push_back(std::move(added));
  }
}

PaperResult run_paper_table(const PaperTable& table, const JobControl& control) {
  PaperResult result;
  result.table = table;
  result.rows.resize(table.rows.size());
  for (auto& row : result.rows) row.runs.resize(table.seeds);
  const std::size_t jobs = table.rows.size() * table.seeds;
  const std::size_t done = run_jobs(jobs, control, [&](std::size_t job) {
    const std::size_t row = job % table.rows.size();
    const std::size_t seed = job / table.rows.size();
    result.rows[row].runs[seed] = run_seed(table, table.rows[row], table.first_seed + seed);
  });
  result.complete = done == jobs;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    result.rows[i].published = run_seed(table, table.rows[i], table.published_seed);
    result.rows[i].predicted_rms_ns = predicted_rms(table.rows[i]);
    summarise(result.rows[i]);
  }
  for (const auto& key : table.figure_rows) {
    for (const auto& row : table.rows) {
      if (row.key() == key) result.traces.push_back(trace_row(row, table.published_seed));
    }
  }
  result.checks = judge_paper_table(result);
  return result;
}

}  // namespace ftcs::experiment
