// SPDX-License-Identifier: MIT
#include "ftcs/experiment/figure_observer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ftcs::experiment {

double DwellTracker::start() const noexcept {
  return found_ ? *entered_ : std::numeric_limits<double>::infinity();
}

FigureObserver::FigureObserver(const Scenario& scenario, RunTrace* trace,
                               const std::atomic<bool>* stop)
    : plan_(scenario.plan),
      interval_s_(scenario.world.interval.seconds()),
      node_(scenario.world.nodes.size() - 1),
      trace_(trace),
      stop_(stop),
      c5_(plan_.converged_band_ns, plan_.converged_dwell_cycles),
      after_event_(plan_.converged_band_ns, plan_.converged_dwell_cycles) {
  if (trace_ != nullptr) trace_->interval_s = interval_s_;
}

void FigureObserver::add_truth(double cycle, double time_s, double error_ns) {
  if (measured(cycle)) time_error_.add(error_ns);
  c5_.add(cycle, error_ns);
  if (first_command_cycle_) {
    const double since = cycle - *first_command_cycle_;
    if (since >= 1.0 && since < 11.0) first_ten_.add(error_ns);
  }
  follow_event(time_s, error_ns);
}

void FigureObserver::follow_event(double time_s, double error_ns) {
  if (!plan_.event_s || time_s < *plan_.event_s) return;
  if (!first_error_after_event_) first_error_after_event_ = error_ns;
  after_event_.add((time_s - *plan_.event_s) / interval_s_, error_ns);
  event_max_ns_ = std::max(event_max_ns_, std::abs(error_ns));
  if (error_ns * *first_error_after_event_ < 0.0) {
    event_overshoot_ns_ = std::max(event_overshoot_ns_, std::abs(error_ns));
  }
}

void FigureObserver::on_truth(const sim::TruthSample& sample) {
  if (stop_ != nullptr && stop_->load(std::memory_order_relaxed)) throw Interrupted{};
  if (sample.node != node_) return;
  if (!plan_.at_samples) add_truth(sample.cycle, sample.time_s, sample.time_error_ns);
  if (measured(sample.cycle)) rate_error_.add(sample.tracking_error_ppb);
  if (trace_ != nullptr) {
    if (sample.cycle < plan_.from_cycle) trace_->first_measured = trace_->time_s.size() + 1;
    trace_->time_s.push_back(sample.time_s);
    trace_->time_error_ns.push_back(sample.time_error_ns);
    trace_->rate_error_ppb.push_back(sample.tracking_error_ppb);
  }
}

void FigureObserver::on_pair(const sim::PairSample& sample) {
  if (sample.node != node_) return;
  const Telemetry& telemetry = *sample.telemetry;
  if (telemetry.commanded) {
    if (!first_command_cycle_) first_command_cycle_ = sample.cycle;
    if (telemetry.step != Duration{}) ++steps_;
    if (telemetry.step < Duration{}) ++backward_steps_;
  }
  if (telemetry.verdict == SampleVerdict::kRejected) ++rejected_;
  const bool holdover = telemetry.servo.state == ServoState::kHoldover;
  if (holdover && !in_holdover_) ++holdovers_;
  in_holdover_ = holdover;
  const bool is_sync = telemetry.direction == Direction::kForward && sample.paces;
  if (plan_.at_samples && is_sync) {
    add_truth(sample.cycle, sample.time_s, sample.time_error_ns);
  }
  if (!measured(sample.cycle) || !telemetry.servo.offset_known) return;
  if (is_sync) perceived_.add(telemetry.servo.offset.ns());
  judge_uncertainty(sample);
}

/// The reported offset against the true one, in units of the reported deviation.
void FigureObserver::judge_uncertainty(const sim::PairSample& sample) {
  const double sigma = sample.telemetry->servo.offset_sigma_ns;
  if (!(sigma > 0.0)) return;
  const double miss = std::abs(sample.telemetry->servo.offset.ns() - sample.time_error_ns);
  for (std::size_t i = 0; i < inside_.size(); ++i) {
    if (miss <= static_cast<double>(i + 1) * sigma) ++inside_[i];
  }
  ++judged_;
}

RunFigures FigureObserver::figures() const {
  RunFigures f;
  f.rms_time_error_ns = time_error_.rms();
  f.max_time_error_ns = time_error_.max_absolute();
  f.mean_time_error_ns = time_error_.mean();
  f.rms_perceived_offset_ns = perceived_.rms();
  f.rms_first_ten_ns = first_ten_.rms();
  f.c5_cycles = c5_.start();
  f.rate_error_ppb = rate_error_.rms();
  if (plan_.event_s) {
    f.event_cycles = after_event_.start();
    f.event_max_ns = event_max_ns_;
    f.event_overshoot_ns = event_overshoot_ns_;
  }
  if (judged_ > 0.0) {
    f.within_1_sigma = inside_[0] / judged_;
    f.within_2_sigma = inside_[1] / judged_;
    f.within_3_sigma = inside_[2] / judged_;
  }
  f.steps = steps_;
  f.backward_steps = backward_steps_;
  f.rejected = rejected_;
  f.holdovers = holdovers_;
  return f;
}

}  // namespace ftcs::experiment
