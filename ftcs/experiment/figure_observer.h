// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <optional>

#include "ftcs/analysis/statistics.h"
#include "ftcs/experiment/run_figures.h"
#include "ftcs/experiment/scenario.h"
#include "ftcs/experiment/scenario_run.h"
#include "ftcs/sim/two_way.h"

namespace ftcs::experiment {

/// Start of the first stay inside a band that lasts `dwell`.
class DwellTracker {
 public:
  DwellTracker(double band, double dwell) noexcept : band_(band), dwell_(dwell) {}

  void add(double at, double value) noexcept {
    if (found_) return;
    if (!(value < band_ && value > -band_)) {
      entered_.reset();
      return;
    }
    if (!entered_) entered_ = at;
    found_ = at - *entered_ >= dwell_;
  }
  /// Infinite if it never came.
  [[nodiscard]] double start() const noexcept;

 private:
  double band_;
  double dwell_;
  std::optional<double> entered_;
  bool found_ = false;
};

/// Watches the last clock of the chain and makes the figures of a run, in constant memory.
class FigureObserver final : public sim::TwoWayObserver {
 public:
  /// `stop`, once set, ends the run: Interrupted is thrown. Null: nobody will.
  FigureObserver(const Scenario& scenario, RunTrace* trace, const std::atomic<bool>* stop);

  void on_truth(const sim::TruthSample& sample) override;
  void on_pair(const sim::PairSample& sample) override;
  [[nodiscard]] RunFigures figures() const;

 private:
  [[nodiscard]] bool measured(double cycle) const noexcept {
    return cycle >= plan_.from_cycle && cycle < plan_.to_cycle;
  }
  void add_truth(double cycle, double time_s, double error_ns);
  void follow_event(double time_s, double error_ns);
  void judge_uncertainty(const sim::PairSample& sample);

  MeasurementPlan plan_;
  double interval_s_;
  std::size_t node_;
  RunTrace* trace_;
  const std::atomic<bool>* stop_;
  RunningStatistics time_error_;
  RunningStatistics perceived_;
  RunningStatistics rate_error_;
  RunningStatistics first_ten_;
  DwellTracker c5_;
  DwellTracker after_event_;
  std::optional<double> first_command_cycle_;
  std::optional<double> first_error_after_event_;
  double event_max_ns_ = 0.0;
  double event_overshoot_ns_ = 0.0;
  std::array<double, 3> inside_{};
  double judged_ = 0.0;
  double steps_ = 0.0;
  double backward_steps_ = 0.0;
  double rejected_ = 0.0;
  double holdovers_ = 0.0;
  bool in_holdover_ = false;
};

}  // namespace ftcs::experiment
