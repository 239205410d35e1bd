// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/cycle_observer.h"

#include <algorithm>
#include <array>

namespace ftcs::daemon {
namespace {

constexpr std::int64_t kWindowNs = 2'000'000'000;
constexpr Nanoseconds kBetweenStates{250'000'000};

WatchMode mode_of(CycleState state) {
  switch (state) {
    case CycleState::kLocked:
      return WatchMode::kLocked;
    case CycleState::kCoasting:
      return WatchMode::kHoldover;
    case CycleState::kAcquiring:
      return WatchMode::kAcquiring;
    case CycleState::kWaiting:
      break;
  }
  return WatchMode::kFreeRun;
}

}  // namespace

CycleObserver::CycleObserver(const RunOptions& options)
    : options_(options),
      window_(static_cast<std::uint64_t>(
          std::max<std::int64_t>(1, kWindowNs / options.servo.cycle.count()))) {}

std::optional<std::string> CycleObserver::open() {
  if (!options_.watch.is_wanted()) return std::nullopt;
  auto watch = Watch::open(options_.watch);
  if (!watch) return watch.error();
  watch_ = std::move(*watch);
  return std::nullopt;
}

void CycleObserver::note(const node::CycleNode& node, const experiment::CycleFigures& figures,
                         FreeRunningTime now) {
  now_ = now;
  const Mark totals{figures.cycles, node.main().counters().lost, node.servo().counters().late};
  if (!start_) {
    start_ = now;
    older_ = newer_ = totals;  // frames of the bring-up are none of the cycle's
  }
  if (totals.cycles - newer_.cycles >= window_) {
    older_ = newer_;
    newer_ = totals;
  }
  if (!watch_) return;
  const CycleDecision& decision = node.decision();
  WatchPoint point;
  point.time_s = (now - *start_).seconds();
  point.offset_ns = decision.phase_error.ns();
  point.sigma_ns = WatchState::kUnknown;
  point.rate_ppb = decision.rate.ppb();
  point.delay_ns = WatchState::kUnknown;
  point.locked = decision.state == CycleState::kLocked;
  point.used = decision.verdict == CycleVerdict::kUsed;
  watch_->feed().add(point);
  if (now >= next_state_) {
    next_state_ = now + Duration{kBetweenStates};
    publish(node, figures);
  }
}

diagnosis::CycleSeen CycleObserver::seen(const node::CycleNode& node,
                                         const experiment::CycleFigures& figures) const {
  const ethercat::MainDevice& main = node.main();
  const ethercat::CycleReport& report = main.last_cycle();
  diagnosis::CycleSeen seen;
  seen.state = node.decision().state;
  seen.failure = main.failure().kind;
  seen.has_reference = main.network().has_reference();
  seen.drives = static_cast<std::uint16_t>(main.network().count);
  if (seen.failure == ethercat::FailureKind::kFewerThanConfigured) {
    seen.drives = main.failure().received;
  }
  seen.expected_drives = static_cast<std::uint16_t>(options_.drives);
  seen.working_counter = report.working_counter;
  seen.expected_counter = report.whole;
  seen.operational = report.all_operational();
  for (std::size_t n = seen.drives; n-- > 0;) {
    if (node.axes()[n].state() != ethercat::AxisState::kFault) continue;
    ++seen.axes_in_fault;
    seen.first_in_fault = static_cast<std::uint16_t>(n);
  }
  seen.cycles = figures.cycles - older_.cycles;
  seen.lost = main.counters().lost - older_.lost;
  seen.late = node.servo().counters().late - older_.late;
  seen.phase_ns = node.decision().phase_error.ns();
  seen.margin_ns = figures.margin.quantile(0.5);
  seen.gate_ns = static_cast<double>(options_.servo.largest_lateness.count());
  seen.cycle_ns = static_cast<double>(options_.servo.cycle.count());
  return seen;
}

std::string_view CycleObserver::sentence(std::span<char> text, const node::CycleNode& node,
                                         const experiment::CycleFigures& figures) const {
  return diagnosis::write_sentence(text, seen(node, figures));
}

void CycleObserver::publish(const node::CycleNode& node, const experiment::CycleFigures& figures) {
  const diagnosis::CycleSeen now = seen(node, figures);
  const CycleServoCounters& counters = node.servo().counters();
  state_.kind.set("ethercat");
  state_.target.set(options_.interface.empty() ? options_.host : options_.interface);
  state_.servo.set(options_.servo_name);
  state_.reference.set("distributed clock");
  state_.mode = mode_of(now.state);
  state_.cause = diagnosis::cause_of(now);
  state_.sentence.size =
      static_cast<std::uint16_t>(diagnosis::write_sentence(state_.sentence.characters, now).size());
  state_.uptime_s = (now_ - *start_).seconds();
  state_.offset_ns = now.phase_ns;
  state_.rate_ppb = node.decision().rate.ppb();
  state_.used = counters.used;
  state_.outliers = counters.doubtful;
  state_.implausible = counters.impossible;
  state_.cycle.present = true;
  state_.cycle.phase_ns = now.phase_ns;
  state_.cycle.margin_ns = now.margin_ns;
  state_.cycle.working_counter = now.working_counter;
  state_.cycle.expected_counter = now.expected_counter;
  state_.cycle.axes_in_fault = now.axes_in_fault;
  state_.cycle.lost = node.main().counters().lost;
  state_.cycle.late = counters.late;
  describe_drives(node, now.margin_ns);
  watch_->feed().publish(state_);
}

/// SYNC0 is at one instant everywhere; the frame comes later to those further down the line.
void CycleObserver::describe_drives(const node::CycleNode& node, double margin_ns) {
  const ethercat::Network& network = node.main().network();
  state_.cycle.drives = static_cast<std::uint16_t>(std::min(network.count, WatchedCycle::kDrives));
  for (std::size_t i = 0; i < state_.cycle.drives; ++i) {
    const ethercat::SubDeviceInfo& device = network.devices[i];
    state_.cycle.drive[i] = {
        static_cast<std::uint8_t>(device.state),
        static_cast<float>((margin_ns - static_cast<double>(device.propagation_delay)) * 1e-3)};
  }
}

}  // namespace ftcs::daemon
