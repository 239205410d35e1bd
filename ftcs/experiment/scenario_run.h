// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ftcs/experiment/parallel.h"
#include "ftcs/experiment/run_figures.h"
#include "ftcs/experiment/scenario.h"

namespace ftcs::experiment {

/// What a reader wants to see drawn: decimated to what a plot can show.
struct RunTrace {
  std::string servo;
  std::vector<double> time_s;
  std::vector<double> time_error_ns;
  std::vector<double> rate_error_ppb;
  std::size_t first_measured = 0;  ///< where the measurement window begins
  double interval_s = 1.0;         ///< of one cycle
};

/// One servo, one seed. Memory does not depend on the length unless a trace is asked for. Throws
/// Interrupted once `stop` is set.
[[nodiscard]] RunFigures run_scenario(const Scenario& scenario, const ScenarioServo& servo,
                                      std::uint64_t seed, RunTrace* trace = nullptr,
                                      const std::atomic<bool>* stop = nullptr);

/// A limit and what became of it.
struct LimitResult {
  std::string figure;
  std::string kind;  ///< "median", "worst", "within", "least"
  double limit = 0.0;
  double measured = 0.0;
  bool passed = false;
};

/// All runs of one servo in one scenario.
struct ServoResult {
  std::string servo;
  std::vector<std::uint64_t> seeds;  ///< of the runs that were finished
  std::vector<RunFigures> runs;
  bool has_limits = false;
  bool required = false;
  bool passed = true;
  std::vector<LimitResult> limits;
  std::string note;

  [[nodiscard]] double median(double RunFigures::*figure) const;
  [[nodiscard]] double worst(double RunFigures::*figure) const;
  /// Share of runs with at most `limit`.
  [[nodiscard]] double share_within(double RunFigures::*figure, double limit) const;
};

struct ScenarioResult {
  std::string scenario;
  std::string title;
  std::vector<ServoResult> servos;
  std::uint64_t seeds = 0;  ///< runs of each servo when all have run

  /// Have all runs of this servo been done? Of some of them a median says nothing yet.
  [[nodiscard]] bool has_all_runs_of(const ServoResult& servo) const noexcept {
    return servo.runs.size() >= seeds;
  }
};

/// Which part of a sweep this process computes: the jobs whose number modulo `count` is `index`.
struct Shard {
  std::size_t index = 0;
  std::size_t count = 1;
};

struct SweepResult {
  std::vector<ScenarioResult> scenarios;
  bool complete = false;

  /// No required limit missed and nothing interrupted.
  [[nodiscard]] bool passed() const;
};

/// Runs every servo of every scenario over its seeds on all cores; packets and oscillators are
/// those of the seed, whatever the servo. The result does not depend on threads or shards.
[[nodiscard]] SweepResult run_sweep(const std::vector<Scenario>& scenarios, const Shard& shard,
                                    const JobControl& control);

/// Joins what shards computed and judges it anew. Scenarios and servos must be the same in all
/// parts.
[[nodiscard]] SweepResult merge_sweeps(const std::vector<Scenario>& scenarios,
                                       const std::vector<SweepResult>& parts);

/// Fills in limits and verdicts from the runs.
void judge(const Scenario& scenario, ScenarioResult& result);

}  // namespace ftcs::experiment
