// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "ftcs/experiment/cycle_experiment.h"

namespace ftcs::experiment {

namespace {

/// Collects demands on the rows of Table 6.
class Judge {
 public:
  explicit Judge(std::vector<PaperCheckResult>& checks) : checks_(checks) {}

  void within(const char* name, const CycleRow& row, const char* against, double expected,
              double tolerance, double measured, double more_ns = 0.0) {
    if (std::isnan(expected)) return;
    const double width = std::abs(expected) * tolerance + more_ns;
    limits(name, row, against, expected - width, expected + width, measured);
    checks_.back().expected = expected;
  }
  void limits(const char* name, const CycleRow& row, const char* against, double least, double most,
              double measured) {
    PaperCheckResult check;
    check.name = name;
    check.subject = row.name;
    check.against = against;
    check.least = least;
    check.most = most;
    check.measured = measured;
    check.passed = !(measured < least) && !(measured > most) && !std::isnan(measured);
    checks_.push_back(check);
  }

 private:
  std::vector<PaperCheckResult>& checks_;
};

/// The tolerances are those of 1,024 runs. FTCS with p = 0 freezes another mean in each run, which
/// shifts both extremes: in fewer runs their median scatters by so much more, three times its
/// standard error.
double of_fewer_runs_ns(const CycleRow& row, const CycleSeedRun& figures, std::uint64_t seeds) {
  if (row.servo.law != CycleLaw::kFtcs || seeds == 0) return 0.0;
  constexpr double kRuns = 1024.0;
  constexpr double kOfMedian = 1.2533;  // sqrt(pi / 2), of a normal distribution
  const double means_ns =
      std::sqrt(std::max(0.0, figures.rms_perceived_ns * figures.rms_perceived_ns -
                                  figures.deviation_perceived_ns * figures.deviation_perceived_ns));
  const double more = 1.0 / std::sqrt(static_cast<double>(seeds)) - 1.0 / std::sqrt(kRuns);
  return 3.0 * kOfMedian * means_ns * std::max(0.0, more);
}

void judge_row(Judge& judge, const CycleRow& row, const CycleSeedRun& figures,
               std::uint64_t seeds) {
  if (row.servo.law == CycleLaw::kAdaptive) {
    const bool coarse = row.world.resolution > Nanoseconds{1};
    const double limit = coarse ? 3000.0 : 400.0;
    judge.limits("rms of the event", row, "bound", 0.0, limit, figures.rms_event_ns);
    judge.limits("rms of the virtual trigger", row, "bound", 0.0, 400.0, figures.rms_virtual_ns);
    return;
  }
  if (row.servo.law == CycleLaw::kFtcs) {
    judge.within("deviation about the mean", row, "model", row.model_deviation_ns, 0.02,
                 figures.deviation_perceived_ns);
    judge.within("deviation about the mean", row, "paper", row.paper_rms_ns, 0.07,
                 figures.deviation_perceived_ns);
  } else {
    judge.within("median rms", row, "model", row.model_rms_ns, 0.03, figures.rms_perceived_ns);
    judge.within("median rms", row, "paper", row.paper_rms_ns, 0.08, figures.rms_perceived_ns);
  }
  const double more_ns = of_fewer_runs_ns(row, figures, seeds);
  judge.within("median minimum", row, "model", row.model_min_ns, 0.05, figures.minimum_ns, more_ns);
  judge.within("median maximum", row, "model", row.model_max_ns, 0.05, figures.maximum_ns, more_ns);
  judge.within("median minimum", row, "paper", row.paper_min_ns, 0.15, figures.minimum_ns);
  judge.within("median maximum", row, "paper", row.paper_max_ns, 0.15, figures.maximum_ns);
  if (std::isnan(row.paper_cycles)) return;
  const bool ftcs = row.servo.law == CycleLaw::kFtcs;
  const double model = ftcs ? 0.0 : 1.0;
  const double paper = ftcs ? 0.0 : 2.0;
  judge.limits("cycles to converge", row, "model", row.model_cycles - model,
               row.model_cycles + model, figures.cycles);
  judge.limits("cycles to converge", row, "paper", row.paper_cycles - paper,
               row.paper_cycles + paper, figures.cycles);
}

}  // namespace

std::vector<PaperCheckResult> judge_table6(const CycleResult& result) {
  std::vector<PaperCheckResult> checks;
  Judge judge(checks);
  for (std::size_t i = 0; i < result.rows.size(); ++i) {
    judge_row(judge, result.rows[i], result.figures[i].median, result.seeds);
  }
  return checks;
}

void add_contour(CycleResult& result, ContourResult contour) {
  const auto demand = [&result](const ContourRow& row, const char* what, double least, double most,
                                double measured) {
    PaperCheckResult check;
    check.name = what;
    check.subject = "circle, " + row.servo;
    check.against = "bound";
    check.least = least;
    check.most = most;
    check.measured = measured;
    check.passed = !(measured < least) && !(measured > most);
    result.checks.push_back(check);
  };
  constexpr double kMany = 1e9;
  /// Rounding of target and position to counts of 1 um, on two axes.
  constexpr double kRoundingUm = 2.0;
  for (const ContourRow& row : contour.rows) {
    const auto missed = static_cast<double>(row.missed_windows);
    if (row.servo == "no sync") {
      demand(row, "missed SYNC0 windows", 1.0, kMany, missed);
      demand(row, "contour error, largest / um", kRoundingUm, kMany, row.max_um);
    } else {
      demand(row, "missed SYNC0 windows", 0.0, 0.0, missed);
      demand(row, "contour error, largest / um", 0.0, kRoundingUm, row.max_um);
    }
  }
  result.contour = std::move(contour);
}

std::vector<PaperChoice> table6_choices() {
  return {
      {"cycles per second", "47", "fits all five rows; 20 ms (50) is the natural number"},
      {"jitter of a reading", "1 us", "fitted with it"},
      {"rate of the local clock", "20 ppm, ±1 ppm between runs", "fitted: the beat with the tick"},
      {"samples", "30 to settle, 200 measured", "consistent with the spread of the PICS rows"},
      {"switch to p = 0", "|E| < 2 us; back at B = 20 us", "Table 1: after some time inside B"},
      {"start", "measured runs: right rate, within a tick; convergence: nominal rate, 300 us",
       "the text gives none; from 200 us PICS5 takes 18 intervals, from 300 us the printed 20"},
      {"RMS of FTCS", "about its own mean",
       "with p = 0 the mean is frozen by the last step of eq. 18; the paper's runs had little"},
  };
}

}  // namespace ftcs::experiment
