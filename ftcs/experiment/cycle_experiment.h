// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/experiment/contour_experiment.h"
#include "ftcs/experiment/paper_run.h"
#include "ftcs/experiment/parallel.h"
#include "ftcs/experiment/two_machines.h"

namespace ftcs::experiment {

/// Section V of the paper: a main device whose timer fires on ticks only, at sync points one or two
/// seconds apart.
///
///   virtual trigger  L(n+1) = L(n) + N_c T_m(n)        a real number
///   event            x(n) = L(n) on the nearest tick of the local clock
///   reference        R(n) = (x(n) + j(n)) / (1 + alpha)  j ~ Normal(0, jitter)
///   perceived        E(n) = n T_sync - R(n)            early is positive
///
/// The servo is the shipped cycle servo; a cycle of it is a whole sync interval, so that eq. 25's
/// k(n) spans the interval and eq. 26's gains are multiplied by N_c.
struct CycleWorld {
  Nanoseconds sync_interval{1'000'000'000};
  Nanoseconds resolution{10'000};
  double jitter_ns = 1000.0;
  double alpha_ppm = 20.0;  ///< mean; runs scatter by ±alpha_spread_ppm
  double alpha_spread_ppm = 1.0;
};

struct CycleRow {
  std::string name;
  bool support = false;  ///< the same code on a finer timer; not a row of the paper's table
  CycleWorld world;
  CycleServoConfig servo;
  double paper_rms_ns = kNotGiven;
  double paper_min_ns = kNotGiven;
  double paper_max_ns = kNotGiven;
  double paper_cycles = kNotGiven;
  double model_rms_ns = kNotGiven;  ///< median over runs, of an independent model
  double model_deviation_ns = kNotGiven;
  double model_min_ns = kNotGiven;
  double model_max_ns = kNotGiven;
  double model_cycles = kNotGiven;
  std::string note;
};

/// One run: 30 intervals to settle, 200 to measure, started at the right rate within one tick; and
/// a second one from the nominal rate and 300 us that counts the cycles to |E| < 20 us for ever.
struct CycleSeedRun {
  bool done = false;
  double rms_perceived_ns = 0.0;
  double deviation_perceived_ns = 0.0;  ///< about the run's own mean
  double minimum_ns = 0.0;
  double maximum_ns = 0.0;
  double rms_event_ns = 0.0;    ///< of the trigger on its tick, measurement jitter apart
  double rms_virtual_ns = 0.0;  ///< of the trigger without its tick
  double cycles = 0.0;
  double cycles_from_first_message = 0.0;
};

struct CycleRowResult {
  std::vector<CycleSeedRun> runs;
  CycleSeedRun median;  ///< field by field
  double percentile_5_ns = 0.0;
  double percentile_95_ns = 0.0;
};

struct CycleTrace {
  std::string row;
  std::vector<double> perceived_ns;
};

struct CycleResult {
  std::vector<CycleRow> rows;
  std::vector<CycleRowResult> figures;
  std::vector<PaperCheckResult> checks;
  std::vector<PaperChoice> choices;
  std::vector<CycleTrace> traces;  ///< Fig. 7: the first seed
  ContourResult contour;           ///< no rows: not run
  std::vector<ContourRow>
      live_contour;                ///< the same over a virtual link; nothing is demanded of it
  TwoMachinesResult two_machines;  ///< no rows: not run
  std::uint64_t seeds = 0;
  bool complete = false;
  [[nodiscard]] bool passed() const noexcept;
};

[[nodiscard]] CycleSeedRun run_cycle_seed(const CycleRow& row, std::uint64_t seed,
                                          CycleTrace* trace = nullptr);
/// The rows of Table 6 and what the adaptive servo makes of the same timer.
[[nodiscard]] std::vector<CycleRow> table6_rows();
/// The tolerances of docs/paper-reproduction.md.
[[nodiscard]] std::vector<PaperCheckResult> judge_table6(const CycleResult& result);
/// What the paper leaves open.
[[nodiscard]] std::vector<PaperChoice> table6_choices();
/// Takes the circle into the result: what synchronisation must bring, as checks.
void add_contour(CycleResult& result, ContourResult contour);
[[nodiscard]] CycleResult run_table6(std::uint64_t seeds, const JobControl& control);

}  // namespace ftcs::experiment
