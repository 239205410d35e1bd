// SPDX-License-Identifier: MIT
#include "ftcs/experiment/cycle_figures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ftcs/sim/drives/drive_motor.h"

namespace ftcs::experiment {

namespace {

float microseconds(double ns) { return static_cast<float>(ns * 1e-3); }

double cycle_s(const node::CycleNode& node) {
  return static_cast<double>(node.config().servo.cycle.count()) * 1e-9;
}

double round_trip_ns(const CycleSample& sample) { return (sample.received - sample.sent).ns(); }

}  // namespace

void CycleFigureWatch::reserve(const node::CycleNode& node, FreeRunningTime start) {
  start_ = start;
  constexpr std::size_t kMostEvents = 1000;
  figures_.events.reserve(kMostEvents);
  constexpr std::size_t kMostGroups = 50'000;
  if (config_.contour) figures_.contour_trace.reserve(kMostGroups);
  constexpr double kMostPoints = 500'000.0;
  const double cycles = config_.duration_s / cycle_s(node) + 1000.0;
  const bool bounded = config_.duration_s > 0.0 && cycles < kMostPoints;
  if (config_.trace)
    figures_.trace.reserve(static_cast<std::size_t>(bounded ? cycles : kMostPoints));
}

void CycleFigureWatch::note(const node::CycleNode& node, FreeRunningTime now) {
  const CycleDecision& decision = node.decision();
  ++figures_.cycles;
  figures_.host_stalls += decision.skipped;
  // SYNC0 comes sync0_phase of a cycle after the frame's own place, and again with each cycle.
  const double late = decision.lateness.seconds() / cycle_s(node);
  figures_.late_windows +=
      static_cast<std::uint64_t>(std::max(0.0, std::floor(late - node.config().sync0_phase) + 1.0));
  const bool answered = node.sample().has_received;
  if (answered && node.main().last_cycle().inputs_valid) ++figures_.working_counter_right;
  figures_.lock = node.supervision().lock();
  figures_.lock_cycle = node.supervision().lock_cycle();
  figures_.op_cycle = node.supervision().op_cycle();
  for (const node::CycleNote& note : node.notes()) {
    if (figures_.events.size() == figures_.events.capacity()) break;
    figures_.events.push_back({(now - start_).seconds(), note});
  }
  if (decision.verdict == CycleVerdict::kUsed) trace(node);
  if (figures_.lock_cycle >= 0) judge(node);
  if (config_.contour) watch_contour(node);
}

void CycleFigureWatch::judge(const node::CycleNode& node) {
  const CycleDecision& decision = node.decision();
  figures_.lateness.add(decision.lateness.ns());
  if (decision.verdict == CycleVerdict::kLate || decision.verdict == CycleVerdict::kSlow) {
    ++figures_.excluded;
    return;
  }
  if (decision.verdict != CycleVerdict::kUsed) return;
  ++figures_.judged;
  figures_.phase.add(decision.phase_error.ns());
  figures_.wire_phase.add((decision.lateness - decision.phase_error).ns());
  figures_.round_trip.add(round_trip_ns(node.sample()));
  figures_.margin.add(static_cast<double>(node.margin_ns()));
  const auto second = static_cast<std::int64_t>(1.0 / cycle_s(node));
  const bool settled = static_cast<std::int64_t>(figures_.cycles) > figures_.lock_cycle + second;
  const ethercat::CycleReport& report = node.main().last_cycle();
  if (settled && node.main().complete() && report.inputs_valid) {
    figures_.worst_difference_ns =
        std::max(figures_.worst_difference_ns.value_or(0), report.difference_bound_ns);
  }
}

/// Before the lock too; and the second half of the run, for a servo that never locks.
void CycleFigureWatch::trace(const node::CycleNode& node) {
  const CycleDecision& decision = node.decision();
  const double time_s = (node.sample().sent - start_).seconds();
  const double wire_ns = (decision.lateness - decision.phase_error).ns();
  if (time_s > config_.duration_s / 2) {
    figures_.second_half_phase.add(decision.phase_error.ns());
    figures_.second_half_wire_phase.add(wire_ns);
  }
  if (figures_.trace.size() == figures_.trace.capacity()) return;
  figures_.trace.push_back({static_cast<float>(time_s), microseconds(decision.phase_error.ns()),
                            microseconds(wire_ns), microseconds(decision.lateness.ns()),
                            microseconds(static_cast<double>(node.margin_ns())),
                            microseconds(round_trip_ns(node.sample()))});
}

/// Both positions are of one SYNC0. From the full radius on.
void CycleFigureWatch::watch_contour(const node::CycleNode& node) {
  const bool two = node.main().network().count >= 2;
  if (!node.axes().path().at_full() || !two || !node.main().last_cycle().inputs_valid) return;
  const node::DriveAxesConfig& axes = node.config().axes;
  const double radius = axes.radius * ethercat::DriveMotor::steady_gain(
                                          2.0 * std::numbers::pi * cycle_s(node) / axes.turn_s);
  const auto at = [&node](std::size_t n) {
    const std::int32_t position = ethercat::csp::Inputs::decode(node.main().inputs(n)).position;
    return static_cast<double>(position - node.axes()[n].origin());
  };
  const double error = std::hypot(at(0), at(1)) - radius;
  figures_.contour.add(error);
  constexpr std::uint64_t kGroup = 20;
  contour_group_ = std::max(contour_group_, std::abs(error));
  if (figures_.contour.count() % kGroup != 0) return;
  if (figures_.contour_trace.size() < figures_.contour_trace.capacity()) {
    figures_.contour_trace.push_back(contour_group_);
  }
  contour_group_ = 0.0;
}

}  // namespace ftcs::experiment
