// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/follower_watch.h"

namespace ftcs::daemon {
namespace {

WatchMode mode_of(const ClockDiscipline& discipline) {
  const ServoSnapshot& servo = discipline.latest().servo;
  if (servo.state == ServoState::kHoldover) return WatchMode::kHoldover;
  if (discipline.locked()) return WatchMode::kLocked;
  return servo.offset_known ? WatchMode::kAcquiring : WatchMode::kFreeRun;
}

}  // namespace

WatchState watch_state(const ClockDiscipline& discipline, std::string_view servo,
                       const diagnosis::Finding& finding) {
  const Telemetry& seen = discipline.latest();
  const DisciplineCounters& counters = discipline.counters();
  WatchState state;
  state.servo.set(servo);
  state.mode = mode_of(discipline);
  state.cause = finding.cause;
  state.sentence.set(diagnosis::sentence(finding));
  if (seen.servo.offset_known) {
    state.offset_ns = seen.servo.offset.ns();
    state.sigma_ns = seen.servo.offset_sigma_ns;
    state.delay_ns = seen.servo.path_delay.ns();
    state.rate_ppb = seen.applied_rate.ppb();
  }
  state.used = counters.used;
  state.outliers = counters.rejected;
  state.duplicates = counters.duplicate;
  state.implausible = counters.implausible;
  state.steps = counters.steps;
  state.holdovers = counters.holdovers;
  return state;
}

WatchPoint watch_point(const SampleRecord& record) {
  const Telemetry& seen = record.telemetry;
  WatchPoint point;
  point.time_s = record.time_s;
  point.offset_ns = record.offset.ns();
  point.sigma_ns = seen.servo.offset_sigma_ns;
  point.rate_ppb = seen.applied_rate.ppb();
  point.delay_ns = seen.servo.path_delay.ns();
  point.locked = seen.locked;
  point.used = seen.verdict == SampleVerdict::kUsed;
  return point;
}

}  // namespace ftcs::daemon
