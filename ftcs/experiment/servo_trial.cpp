// SPDX-License-Identifier: MIT
#include "ftcs/experiment/servo_trial.h"

#include <cmath>
#include <span>

#include "ftcs/analysis/statistics.h"

namespace ftcs::experiment {
namespace {

RunningStatistics statistics_of(std::span<const double> values) {
  RunningStatistics statistics;
  for (const double value : values) statistics.add(value);
  return statistics;
}

double rms(std::span<const double> values) { return statistics_of(values).rms(); }

template <class Values>
std::span<const double> tail(const Values& values, std::size_t first) {
  return std::span<const double>(values).subspan(first < values.size() ? first : values.size());
}

}  // namespace

ServoTrial::ServoTrial(const Setup& setup, SkewedSource& source)
    : setup_(setup),
      source_(source),
      clock_(source, setup.clock),
      discipline_(setup.discipline, clock_) {}

double ServoTrial::true_offset_ns(FreeRunningTime underlying) const noexcept {
  const LocalTime local = clock_.local_at(source_.from_underlying(underlying));
  return offset_from_reference(local, setup_.truth.at(underlying)).ns();
}

void ServoTrial::record_truth_since_last(FreeRunningTime underlying) {
  const FreeRunningTime start = last_sample_.value_or(underlying);
  const double interval_ns = (underlying - start).ns();
  for (int i = 1; i <= kPointsPerInterval; ++i) {
    const auto elapsed = Duration::from_ns(interval_ns * i / kPointsPerInterval);
    true_between_.push_back(true_offset_ns(start + elapsed));
  }
  true_at_samples_.push_back(true_offset_ns(underlying));
  last_sample_ = underlying;
}

void ServoTrial::on_pair(const EventPair& pair) {
  const bool forward = pair.direction == Direction::kForward;
  // Before the servo acts on this message: what follows must not colour what was.
  if (forward) record_truth_since_last(source_.to_underlying(pair.free_running));

  const Telemetry telemetry = discipline_.on_pair(pair);
  if (telemetry.commanded && !first_action_) first_action_ = true_at_samples_.size() - 1;
  if (!forward) return;

  perceived_.push_back(telemetry.servo.offset.ns());
  const Rate true_rate = telemetry.tracking_rate * source_.rate();
  rate_error_ppb_.push_back(true_rate.ppb());
}

TrialResult ServoTrial::result(double lock_band_ns) const {
  ConvergenceTracker tracker(lock_band_ns, kLockDwell);
  for (std::size_t i = 0; i < true_at_samples_.size(); ++i) {
    // Before the first action nothing was controlled: being near by chance is not being locked.
    const bool controlled = first_action_ && i >= *first_action_;
    tracker.add(controlled ? true_at_samples_[i] : kNoFigure, controlled && i == *first_action_);
  }
  const Convergence convergence = tracker.result();

  TrialResult result;
  result.servo = setup_.name;
  result.cycles_to_lock = convergence.cycles_to_dwell(ConvergenceOrigin::kFirstAction);
  result.locked = result.cycles_to_lock.has_value();
  if (result.locked) result.locked_at_sync = *convergence.dwelt + 1;
  result.samples = true_at_samples_.size();
  result.rejected = discipline_.counters().rejected;
  result.true_offsets_ns = true_at_samples_;
  if (!true_at_samples_.empty()) result.final_time_error_ns = true_at_samples_.back();

  // Not locked: the second half, so that the figure still says where it hangs.
  const std::size_t from = convergence.dwelt ? *convergence.dwelt : true_at_samples_.size() / 2;
  result.rms_perceived_offset_ns = rms(tail(perceived_, from));
  result.rms_time_error_ns = rms(tail(true_between_, (from + 1) * kPointsPerInterval));
  const std::size_t half = true_at_samples_.size() / 2;
  const auto second_half = statistics_of(tail(true_between_, (half + 1) * kPointsPerInterval));
  result.rms_second_half_ns = second_half.rms();
  result.mean_second_half_ns = second_half.mean();
  result.rate_error_ppb = rms(tail(rate_error_ppb_, from));
  bool inside = true;
  for (const double offset : tail(true_at_samples_, from)) {
    const bool now_inside = std::abs(offset) < lock_band_ns;
    if (convergence.dwelt && inside && !now_inside) ++result.excursions;
    inside = now_inside;
  }
  return result;
}

}  // namespace ftcs::experiment
