// SPDX-License-Identifier: MIT
#include "ftcs/experiment/cycle_experiment.h"

#include <algorithm>
#include <cmath>

#include "ftcs/analysis/statistics.h"
#include "ftcs/sim/random.h"

namespace ftcs::experiment {

namespace {

constexpr int kSettling = 30;
constexpr int kMeasured = 200;
constexpr int kConvergenceRun = 120;
constexpr double kStartErrorNs = 300'000.0;
constexpr double kConvergedNs = 20'000.0;
/// Main cycles per second: 47 of 21.3 ms fit the printed figures best (20 ms would be 50).
constexpr double kCyclesPerSecond = 47.0;

/// The world of CycleWorld, one interval at a time.
class Run {
 public:
  Run(const CycleRow& row, std::uint64_t seed, bool right_rate, double first_error_ns)
      : row_(row),
        jitter_(seed, "jitter"),
        servo_(config_of(row, seed, right_rate)),
        alpha_(alpha_of(row, seed)) {
    // Reference grid and tick grid meet at local zero; the first trigger is first_error early
    // there.
    const FreeRunningTime first = FreeRunningTime{} - Duration::from_ns(first_error_ns);
    decision_ =
        servo_.start(first - scale(Duration{row.servo.cycle},
                                   config_of(row, seed, right_rate).initial_rate.inverse()));
  }
  struct Step {
    double perceived_ns = 0.0;
    double event_ns = 0.0;
    double virtual_ns = 0.0;
    bool commanded = false;
  };
  Step step() {
    const FreeRunningTime event = decision_.wake;
    const FreeRunningTime exact = decision_.virtual_instant;
    const Duration noise = Duration::from_ns(row_.world.jitter_ns * jitter_.normal());
    Step result;
    result.event_ns = error_at(event);
    result.virtual_ns = error_at(exact);
    CycleSample sample;
    sample.has_reference = true;
    sample.sent = event;
    sample.reference = reference_at(event + noise);
    decision_ = servo_.update(sample, exact);
    result.perceived_ns = decision_.phase_error.ns();
    result.commanded = decision_.commanded;
    return result;
  }

 private:
  static double alpha_of(const CycleRow& row, std::uint64_t seed) {
    sim::RandomStream stream(seed, "alpha");
    const double spread = row.world.alpha_spread_ppm * (2.0 * stream.uniform() - 1.0);
    return (row.world.alpha_ppm + spread) * 1e-6;
  }
  static CycleServoConfig config_of(const CycleRow& row, std::uint64_t seed, bool right_rate) {
    CycleServoConfig config = row.servo;
    if (right_rate) config.initial_rate = Rate::from_ratio(1.0 / (1.0 + alpha_of(row, seed)));
    return config;
  }
  [[nodiscard]] Rate slope() const { return Rate::from_ratio(1.0 / (1.0 + alpha_)); }
  [[nodiscard]] ReferenceTime reference_at(FreeRunningTime t) const {
    return ReferenceTime{epoch() + scale(t - FreeRunningTime{}, slope())};
  }
  /// Some whole intervals before, so that no reading is negative.
  [[nodiscard]] Duration epoch() const {
    constexpr std::int64_t kIntervalsBefore = 100;
    return Duration{row_.world.sync_interval * kIntervalsBefore};
  }
  /// Grid minus reference: early is positive.
  [[nodiscard]] double error_at(FreeRunningTime t) const {
    const Duration at = reference_at(t).since_epoch();
    const std::int64_t interval = row_.world.sync_interval.count();
    const std::int64_t grid = (at.floor_ns() + interval / 2) / interval * interval;
    return (Duration::from_whole_ns(grid) - at).ns();
  }

  const CycleRow& row_;
  sim::RandomStream jitter_;
  CycleServo servo_;
  double alpha_;
  CycleDecision decision_;
};

void measure(const CycleRow& row, std::uint64_t seed, CycleSeedRun& result, CycleTrace* trace) {
  sim::RandomStream stream(seed, "start");
  const auto tick = static_cast<double>(row.world.resolution.count());
  Run run(row, seed, true, -tick * stream.uniform());
  RunningStatistics perceived;
  RunningStatistics event;
  RunningStatistics exact;
  for (int n = 0; n < kSettling + kMeasured; ++n) {
    const Run::Step step = run.step();
    if (n < kSettling) continue;
    perceived.add(step.perceived_ns);
    event.add(step.event_ns);
    exact.add(step.virtual_ns);
    if (trace != nullptr) trace->perceived_ns.push_back(step.perceived_ns);
  }
  result.rms_perceived_ns = perceived.rms();
  result.deviation_perceived_ns = perceived.standard_deviation();
  result.minimum_ns = perceived.minimum();
  result.maximum_ns = perceived.maximum();
  result.rms_event_ns = event.rms();
  result.rms_virtual_ns = exact.rms();
}

void converge(const CycleRow& row, std::uint64_t seed, CycleSeedRun& result) {
  Run run(row, seed, false, kStartErrorNs);
  int first_action = -1;
  int settled = 0;
  for (int n = 0; n < kConvergenceRun; ++n) {
    const Run::Step step = run.step();
    if (step.commanded && first_action < 0) first_action = n;
    if (std::abs(step.perceived_ns) >= kConvergedNs) settled = n + 1;
  }
  result.cycles = settled - std::max(first_action, 0);
  result.cycles_from_first_message = settled;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return quantile_of_sorted(values, 0.5);
}

CycleRow row_of(const std::string& name, CycleLaw law, int seconds) {
  CycleRow row;
  row.name = name;
  row.world.sync_interval = Nanoseconds{seconds * 1'000'000'000LL};
  CycleServoConfig& servo = row.servo;
  servo.law = law;
  servo.cycle = row.world.sync_interval;
  servo.cycles_per_sync = 1;
  servo.resolution = row.world.resolution;
  servo.offset_gain = 0.0;
  // Eq. 25 with p = 0 once within 2 us; back to p = 1 beyond B = 20 us.
  servo.band = {Nanoseconds{2'000}, Nanoseconds{20'000}};
  servo.converged_dwell = 0;
  servo.largest_lateness = Nanoseconds{0};
  servo.largest_round_trip = Nanoseconds{0};
  servo.align_at_start = false;
  // The paper's servo takes the event for the virtual trigger: the tick is noise to it.
  servo.trigger = law == CycleLaw::kAdaptive ? TriggerModel::kKnown : TriggerModel::kIdeal;
  return row;
}

CycleRow pics_row(const std::string& name, int seconds, double proportional, double integral) {
  CycleRow row = row_of(name, CycleLaw::kPics, seconds);
  row.servo.proportional_gain = kCyclesPerSecond * seconds * proportional;
  row.servo.integral_gain = kCyclesPerSecond * seconds * integral;
  return row;
}

void expect_paper(CycleRow& row, double rms, double minimum, double maximum, double cycles) {
  row.paper_rms_ns = rms;
  row.paper_min_ns = minimum;
  row.paper_max_ns = maximum;
  row.paper_cycles = cycles;
}

void expect_model(CycleRow& row, double rms, double deviation, double minimum, double maximum,
                  double cycles) {
  row.model_rms_ns = rms;
  row.model_deviation_ns = deviation;
  row.model_min_ns = minimum;
  row.model_max_ns = maximum;
  row.model_cycles = cycles;
}

}  // namespace

CycleSeedRun run_cycle_seed(const CycleRow& row, std::uint64_t seed, CycleTrace* trace) {
  CycleSeedRun result;
  measure(row, seed, result, trace);
  converge(row, seed, result);
  result.done = true;
  return result;
}

std::vector<CycleRow> table6_rows() {
  std::vector<CycleRow> rows;
  rows.push_back(row_of("FTCS 1 s", CycleLaw::kFtcs, 1));
  expect_paper(rows.back(), 4131.5, -11159, 10160, 1);
  expect_model(rows.back(), 4740, 4314, -10537, 10443, 1);
  rows.push_back(pics_row("PICS4", 1, 0.02, 0.01));
  expect_paper(rows.back(), 5719.4, -12120, 13520, kNotGiven);
  expect_model(rows.back(), 5329, kNotGiven, -12700, 12726, 5);
  rows.push_back(pics_row("PICS5", 1, 0.005, 0.003));
  expect_paper(rows.back(), 4048.0, -8761, 11239, 20);
  expect_model(rows.back(), 4072, kNotGiven, -9765, 9939, 20);
  rows.push_back(row_of("FTCS 2 s", CycleLaw::kFtcs, 2));
  expect_paper(rows.back(), 4111.7, -10159, 9996, 1);
  expect_model(rows.back(), 4657, 4296, -10625, 9994, 1);
  rows.push_back(pics_row("PICS6", 2, 0.01, 0.01));
  expect_paper(rows.back(), 6453.8, -15320, 15011, kNotGiven);
  expect_model(rows.back(), 6855, kNotGiven, -16403, 16513, 2);
  rows.push_back(row_of("adaptive 1 s", CycleLaw::kAdaptive, 1));
  rows.push_back(row_of("adaptive 1 s, 1 ns timer", CycleLaw::kAdaptive, 1));
  rows.back().world.resolution = rows.back().servo.resolution = Nanoseconds{1};
  rows.back().support = true;
  rows.push_back(row_of("FTCS 1 s, 1 ns timer", CycleLaw::kFtcs, 1));
  rows.back().world.resolution = rows.back().servo.resolution = Nanoseconds{1};
  rows.back().support = true;
  // sqrt(2) (tick^2 / 12 + j^2)^(1/2) with j = 1 us: the jitter alone.
  rows.back().model_deviation_ns = 1414.2;
  return rows;
}

CycleResult run_table6(std::uint64_t seeds, const JobControl& control) {
  CycleResult result;
  result.rows = table6_rows();
  result.seeds = seeds;
  result.figures.resize(result.rows.size());
  result.traces.resize(result.rows.size());
  for (std::size_t i = 0; i < result.rows.size(); ++i) {
    result.figures[i].runs.resize(seeds);
    result.traces[i].row = result.rows[i].name;
  }
  const std::size_t jobs = result.rows.size() * seeds;
  const std::size_t done = run_jobs(jobs, control, [&result, seeds](std::size_t job) {
    const std::size_t i = job / seeds;
    const std::uint64_t seed = job % seeds;
    CycleTrace* trace = seed == 0 ? &result.traces[i] : nullptr;
    result.figures[i].runs[seed] = run_cycle_seed(result.rows[i], seed + 1, trace);
  });
  result.complete = done == jobs;
  for (CycleRowResult& figures : result.figures) {
    const auto collect = [&figures](double CycleSeedRun::*field) {
      std::vector<double> values;
      for (const CycleSeedRun& run : figures.runs) {
        if (run.done) values.push_back(run.*field);
      }
      std::sort(values.begin(), values.end());
      return values;
    };
    for (double CycleSeedRun::*field :
         {&CycleSeedRun::rms_perceived_ns, &CycleSeedRun::deviation_perceived_ns,
          &CycleSeedRun::minimum_ns, &CycleSeedRun::maximum_ns, &CycleSeedRun::rms_event_ns,
          &CycleSeedRun::rms_virtual_ns, &CycleSeedRun::cycles,
          &CycleSeedRun::cycles_from_first_message}) {
      figures.median.*field = median(collect(field));
    }
    const std::vector<double> rms = collect(&CycleSeedRun::rms_perceived_ns);
    figures.percentile_5_ns = quantile_of_sorted(rms, 0.05);
    figures.percentile_95_ns = quantile_of_sorted(rms, 0.95);
  }
  result.checks = judge_table6(result);
  result.choices = table6_choices();
  return result;
}

bool CycleResult::passed() const noexcept {
  return complete && two_machines.passed() &&
         std::all_of(checks.begin(), checks.end(),
                     [](const PaperCheckResult& check) { return check.passed; });
}

}  // namespace ftcs::experiment
