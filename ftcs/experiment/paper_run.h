// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/experiment/paper_table.h"
#include "ftcs/experiment/parallel.h"

namespace ftcs::experiment {

/// One seed of one row.
struct PaperSeedRun {
  bool done = false;
  double rms_perceived_ns = 0.0;
  double deviation_perceived_ns = 0.0;  ///< about the run's own mean
  double rms_true_ns = 0.0;
  double cycles = 0.0;  ///< from the first action; infinite if it never settled
  double cycles_from_first_message = 0.0;
};

struct PaperRowResult {
  std::vector<PaperSeedRun> runs;  ///< index: seed - first seed
  PaperSeedRun published;
  // Over all runs that were finished.
  double rms_perceived_ns = 0.0;
  double deviation_ns = 0.0;
  double rms_true_ns = 0.0;
  double median_rms_ns = 0.0;
  double percentile_5_ns = 0.0;
  double percentile_95_ns = 0.0;
  double median_cycles = 0.0;
  double percentile_5_cycles = 0.0;
  double percentile_95_cycles = 0.0;
  double median_cycles_from_first_message = 0.0;
  double predicted_rms_ns = 0.0;  ///< closed form; for p = 0 about the run's own mean
};

/// A demand met or missed, row by row where it speaks of rows.
struct PaperCheckResult {
  std::string name;
  std::string subject;  ///< row, or rows
  std::string against;
  double expected = kNotGiven;
  double least = kNotGiven;
  double most = kNotGiven;
  double measured = kNotGiven;
  bool demanded = true;
  bool passed = true;  ///< of a reported-only line: always true
  std::string note;
};

/// The published run of one row, for a figure.
struct PaperTrace {
  std::string row;
  double interval_ns = 0.0;
  std::vector<double> perceived_offset_ns;
  std::vector<double> time_error_ns;
  std::vector<double> rate_ppm;
};

struct PaperResult {
  PaperTable table;
  std::vector<PaperRowResult> rows;  ///< as table.rows
  std::vector<PaperCheckResult> checks;
  std::vector<PaperTrace> traces;
  bool complete = false;  ///< false: interrupted; figures are of the finished runs

  [[nodiscard]] bool passed() const noexcept;
};

/// One more row for each group of the table: that servo in the world of the group's first row.
void add_servo(PaperTable& table, const std::shared_ptr<const ServoLibrary>& library);

/// Runs every row over every seed, the shipped servo on the virtual clock, common noise for all
/// rows of a seed.
[[nodiscard]] PaperResult run_paper_table(const PaperTable& table, const JobControl& control);

}  // namespace ftcs::experiment
