// SPDX-License-Identifier: MIT
#include "ftcs/experiment/scenario_run.h"

#include <algorithm>
#include <cmath>

#include "ftcs/analysis/statistics.h"
#include "ftcs/experiment/figure_observer.h"
#include "ftcs/experiment/servo_library.h"
#include "ftcs/sim/ptp_network.h"

namespace ftcs::experiment {
namespace {

std::vector<double> sorted(const std::vector<RunFigures>& runs, double RunFigures::*figure) {
  std::vector<double> values;
  for (const RunFigures& run : runs) {
    if (!std::isnan(run.*figure)) values.push_back(run.*figure);
  }
  std::sort(values.begin(), values.end());
  return values;
}

/// One job of a sweep.
struct Job {
  std::size_t scenario;
  std::size_t servo;
  std::uint64_t seed;
};

std::vector<Job> jobs_of(const std::vector<Scenario>& scenarios, const Shard& shard) {
  std::vector<Job> jobs;
  std::size_t number = 0;
  for (std::size_t i = 0; i < scenarios.size(); ++i) {
    for (std::uint64_t seed = 0; seed < scenarios[i].seeds; ++seed) {
      for (std::size_t k = 0; k < scenarios[i].servos.size(); ++k) {
        if (number++ % shard.count == shard.index)
          jobs.push_back({i, k, scenarios[i].first_seed + seed});
      }
    }
  }
  return jobs;
}

SweepResult empty_result(const std::vector<Scenario>& scenarios) {
  SweepResult result;
  for (const Scenario& scenario : scenarios) {
    ScenarioResult entry{scenario.name, scenario.title, {}, scenario.seeds};
    for (const ScenarioServo& servo : scenario.servos) {
      entry.servos.emplace_back();
      entry.servos.back().servo = servo.name;
    }
    result.scenarios.push_back(std::move(entry));
  }
  return result;
}

void judge_figure(const FigureLimit& limit, const ServoResult* bound_row, ServoResult& servo) {
  const auto figure = limit.figure->figure;
  const auto add = [&](const char* kind, double bound, double measured, bool passed) {
    servo.limits.push_back({std::string(limit.figure->name), kind, bound, measured, passed});
    servo.passed = servo.passed && passed;
  };
  if (!std::isnan(limit.median)) {
    const double median = servo.median(figure);
    add("median", limit.median, median, median <= limit.median);
  }
  if (!std::isnan(limit.worst)) {
    const double worst = servo.worst(figure);
    add("worst", limit.worst, worst, worst <= limit.worst);
  }
  if (!std::isnan(limit.within)) {
    const double share = servo.share_within(figure, limit.within);
    add("within", limit.share, share, share >= limit.share);
  }
  if (!std::isnan(limit.least)) {
    const double median = servo.median(figure);
    add("least", limit.least, median, median >= limit.least);
  }
  if (bound_row == nullptr) return;
  if (!std::isnan(limit.median_of_bound)) {
    const double factor = servo.median(figure) / bound_row->median(figure);
    add("median of bound", limit.median_of_bound, factor, factor <= limit.median_of_bound);
  }
  if (!std::isnan(limit.worst_of_bound)) {
    const double factor = servo.worst(figure) / bound_row->worst(figure);
    add("worst of bound", limit.worst_of_bound, factor, factor <= limit.worst_of_bound);
  }
}

}  // namespace

double ServoResult::median(double RunFigures::*figure) const {
  const auto values = sorted(runs, figure);
  if (values.empty()) return RunFigures::kNone;
  const std::size_t half = values.size() / 2;
  // Not the interpolating quantile: a run that never converged is infinite, and inf - inf is no
  // figure.
  if (values.size() % 2 == 1 || values[half] == values[half - 1]) return values[half];
  return 0.5 * (values[half - 1] + values[half]);
}

double ServoResult::worst(double RunFigures::*figure) const {
  const auto values = sorted(runs, figure);
  return values.empty() ? RunFigures::kNone : values.back();
}

double ServoResult::share_within(double RunFigures::*figure, double limit) const {
  const auto values = sorted(runs, figure);
  if (values.empty()) return RunFigures::kNone;
  const auto inside =
      std::count_if(values.begin(), values.end(), [limit](double v) { return v <= limit; });
  return static_cast<double>(inside) / static_cast<double>(values.size());
}

RunFigures run_scenario(const Scenario& scenario, const ScenarioServo& servo, std::uint64_t seed,
                        RunTrace* trace, const std::atomic<bool>* stop) {
  sim::TwoWaySpec world = scenario.world;
  std::vector<ServoInstance> instances;  // one a clock, until the end of the run
  for (auto& node : world.nodes) {
    node.discipline.servo = servo.config;
    if (!servo.plugin) continue;
    instances.emplace_back(*servo.plugin, servo.config);
    node.discipline.servo.external = instances.back().config();
  }
  world.clean_only = servo.clean_only;
  if (trace != nullptr) trace->servo = servo.name;
  FigureObserver observer(scenario, trace, stop);
  if (scenario.network == "ptp") {
    sim::run_ptp_network(world, seed, observer);
  } else {
    sim::run_two_way(world, seed, observer);
  }
  return observer.figures();
}

void judge(const Scenario& scenario, ScenarioResult& result) {
  const auto bound = std::find_if(result.servos.begin(), result.servos.end(),
                                  [](const ServoResult& servo) { return is_bound(servo.servo); });
  const ServoResult* const bound_row = bound == result.servos.end() ? nullptr : &*bound;
  for (ServoResult& servo : result.servos) {
    servo.limits.clear();
    servo.passed = true;
    for (const ScenarioLimit& limit : scenario.limits) {
      if (limit.servo != servo.servo) continue;
      servo.has_limits = true;
      servo.required = servo.required || limit.required;
      servo.note = limit.note;
      for (const FigureLimit& figure : limit.figures) judge_figure(figure, bound_row, servo);
    }
  }
}

bool SweepResult::passed() const {
  if (!complete) return false;
  for (const ScenarioResult& scenario : scenarios) {
    for (const ServoResult& servo : scenario.servos) {
      if (servo.required && !servo.passed) return false;
    }
  }
  return true;
}

SweepResult run_sweep(const std::vector<Scenario>& scenarios, const Shard& shard,
                      const JobControl& control) {
  const std::vector<Job> jobs = jobs_of(scenarios, shard);
  std::vector<RunFigures> figures(jobs.size());
  std::vector<char> done(jobs.size(), 0);
  const std::size_t finished = run_jobs(jobs.size(), control, [&](std::size_t i) {
    const Scenario& scenario = scenarios[jobs[i].scenario];
    figures[i] =
        run_scenario(scenario, scenario.servos[jobs[i].servo], jobs[i].seed, nullptr, control.stop);
    done[i] = 1;
  });
  SweepResult result = empty_result(scenarios);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (done[i] == 0) continue;
    ServoResult& servo = result.scenarios[jobs[i].scenario].servos[jobs[i].servo];
    servo.seeds.push_back(jobs[i].seed);
    servo.runs.push_back(figures[i]);
  }
  result.complete = finished == jobs.size() && shard.count == 1;
  for (std::size_t i = 0; i < scenarios.size(); ++i) judge(scenarios[i], result.scenarios[i]);
  return result;
}

SweepResult merge_sweeps(const std::vector<Scenario>& scenarios,
                         const std::vector<SweepResult>& parts) {
  SweepResult result = empty_result(scenarios);
  result.complete = true;
  for (std::size_t i = 0; i < scenarios.size(); ++i) {
    for (std::size_t k = 0; k < scenarios[i].servos.size(); ++k) {
      ServoResult& servo = result.scenarios[i].servos[k];
      std::vector<std::pair<std::uint64_t, RunFigures>> runs;
      for (const SweepResult& part : parts) {
        const ServoResult& from = part.scenarios.at(i).servos.at(k);
        for (std::size_t r = 0; r < from.runs.size(); ++r)
          runs.emplace_back(from.seeds[r], from.runs[r]);
      }
      std::sort(runs.begin(), runs.end(),
                [](const auto& a, const auto& b) { return a.first < b.first; });
      for (const auto& [seed, figures] : runs) {
        if (!servo.seeds.empty() && servo.seeds.back() == seed) continue;  // the same shard twice
        servo.seeds.push_back(seed);
        servo.runs.push_back(figures);
      }
      result.complete = result.complete && servo.runs.size() == scenarios[i].seeds;
    }
    judge(scenarios[i], result.scenarios[i]);
  }
  return result;
}

}  // namespace ftcs::experiment
