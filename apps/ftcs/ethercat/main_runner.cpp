// SPDX-License-Identifier: MIT
#include "apps/ftcs/ethercat/main_runner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "ftcs/ethercat/maindevice/csp_profile.h"
#include "ftcs/ethercat/subdevice/drive_motor.h"

namespace ftcs::app {

namespace {

using ethercat::AlState;
using platform::HostClock;

/// A frame of the bring-up that is not back by then is lost.
constexpr Nanoseconds kReplyTimeout{5'000'000};
/// A segment in software may have to wait for its processor: half a second until nobody answers.
constexpr std::uint32_t kRetries = 100;
/// The part of a cycle in which its frame must be back.
constexpr double kReplyShare = 0.8;
/// Asking for OP again and again would only fill the frames.
constexpr std::uint64_t kCyclesBetweenRequests = 1000;
/// Live lines on the terminal.
constexpr Nanoseconds kLineInterval{1'000'000'000};

float microseconds(double ns) { return static_cast<float>(ns * 1e-3); }

LocalTime as_local(FreeRunningTime time) { return LocalTime{time.since_epoch()}; }

ethercat::MainDeviceConfig make_config(const RunOptions& options, bool scan_only,
                                       std::span<const ethercat::SdoDownload> objects) {
  ethercat::MainDeviceConfig config;
  config.expected_subdevices = options.drives;
  config.retries = kRetries;
  config.lost_frame_limit = options.lost_frame_limit;
  config.scan_only = scan_only;
  config.clocks.drift_pulses = scan_only ? 0 : options.drift_pulses;
  config.process.objects = objects;
  config.process.cycle = options.servo.cycle;
  const auto cycle = static_cast<double>(options.servo.cycle.count());
  config.process.sync0_shift =
      options.servo.shift + Nanoseconds{static_cast<std::int64_t>(options.sync0_phase * cycle)};
  const double ride_through = options.ride_through_s * 1e9 / cycle;
  config.absence_limit = std::max(config.absence_limit, static_cast<std::uint32_t>(ride_through));
  return config;
}

}  // namespace

MainRunner::MainRunner(const RunOptions& options, platform::EthercatLink link)
    : options_(options), link_(std::move(link)), path_(options.radius, options.turn_s) {
  const auto objects = ethercat::csp_objects(options.servo.cycle);
  objects_.assign(objects.begin(), objects.end());
  objects_.push_back({{0x10F1, 2}, 2, options.sync_error_limit, false});
  servo_ = std::make_unique<CycleServo>(options.servo);
}

bool MainRunner::exchange(FreeRunningTime deadline, CycleSample* sample) {
  const ethercat::ConstBytes frame = main_->next_frame();
  if (frame.empty()) return false;
  FreeRunningTime sent = HostClock::now();
  const int error = link_.send(frame);
  bool answered = false;
  FreeRunningTime received = sent;
  while (error == 0 && !answered) {
    const auto back = link_.receive(deadline, false);
    if (!back) break;
    received = back->stamp;
    const auto outcome = main_->on_frame(back->frame, {as_local(sent), as_local(back->stamp)});
    answered = outcome != ethercat::FrameOutcome::kIgnored;
  }
  if (const auto stamp = link_.transmit_stamp()) sent = *stamp;
  if (!answered) main_->on_timeout();
  if (sample != nullptr) {
    sample->sent = sent;
    sample->received = received;
    sample->has_received = answered;
  }
  return answered;
}

bool MainRunner::bring_up(const std::function<bool()>& stop, bool scan_only) {
  main_ = std::make_unique<ethercat::MainDevice>(make_config(options_, scan_only, objects_));
  auto stage = ethercat::Stage::kStopped;
  while (!main_->cyclic() && main_->stage() != ethercat::Stage::kStopped) {
    if (stop()) return false;
    if (stage != main_->stage() && !options_.quiet && !scan_only) {
      stage = main_->stage();
      fmt::print("{} ...\n", ethercat::name(stage));
      std::fflush(stdout);
    }
    exchange(HostClock::now() + Duration{kReplyTimeout}, nullptr);
  }
  return !main_->failure();
}

/// Before the first cycle: nothing is allocated later.
void MainRunner::reserve_trace() {
  constexpr std::size_t kMostEvents = 1000;
  figures_.events.reserve(kMostEvents);
  constexpr std::size_t kMostGroups = 50'000;
  if (options_.contour) figures_.contour_trace.reserve(kMostGroups);
  constexpr double kMostPoints = 500'000.0;
  const double cycle_s = static_cast<double>(options_.servo.cycle.count()) * 1e-9;
  const double cycles = options_.duration_s / cycle_s + 1000.0;
  const bool bounded = options_.duration_s > 0.0 && cycles < kMostPoints;
  if (options_.trace)
    figures_.trace.reserve(static_cast<std::size_t>(bounded ? cycles : kMostPoints));
}

void MainRunner::run(const std::function<bool()>& stop) {
  csv_.begin();
  axes_.resize(main_->network().count);
  reserve_trace();
  unlocked_limit_ = static_cast<std::uint64_t>(options_.unlocked_limit_s * 1e9 /
                                               static_cast<double>(options_.servo.cycle.count()));
  seen_.assign(main_->network().count, Seen::kNotYet);
  reintegrating_ = main_->network().count;
  start_ = HostClock::now();
  next_line_ = start_ + Duration{kLineInterval};
  decision_ = servo_->start(start_);
  try {
    while (!stop() && main_->stage() == ethercat::Stage::kCyclic) {
      const double elapsed_s = (HostClock::now() - start_).seconds();
      if (options_.duration_s > 0.0 && elapsed_s > options_.duration_s) break;
      cycle();
    }
  } catch (...) {  // live lines that cannot be printed
    stop_drives();
    throw;
  }
  stop_drives();
}

/// They shall not find out by their watchdogs.
void MainRunner::stop_drives() {
  main_->stop();
  while (main_->stage() != ethercat::Stage::kStopped) {
    exchange(HostClock::now() + Duration{kReplyTimeout}, nullptr);
  }
}

void MainRunner::cycle() {
  HostClock::wait_until(decision_.wake, options_.spin);
  move_axes();
  const auto limit =
      static_cast<std::int64_t>(kReplyShare * static_cast<double>(options_.servo.cycle.count()));
  CycleSample sample;
  if (decision_.state != CycleState::kWaiting) {
    const LocalTime now = servo_->local_at(HostClock::now());
    main_->set_reference_estimate(
        ReferenceTime{now.since_epoch() + Duration{options_.servo.transit}});
  }
  const bool answered = exchange(HostClock::now() + Duration::from_whole_ns(limit), &sample);
  const ethercat::CycleReport& report = main_->last_cycle();
  sample.has_reference = answered && report.has_reference;
  sample.reference = report.reference;
  decision_ = servo_->update(sample, HostClock::now());
  note(sample, answered);
  watch_lock();
  watch_drives();
  if (options_.contour) watch_contour();
  supervise();
  if (csv_.is_open()) {
    csv_.write(figures_.cycles, decision_, sample, report.working_counter, margin_ns(sample));
  }
  if (HostClock::now() >= next_line_) {
    next_line_ = next_line_ + Duration{kLineInterval};
    link_.refresh_clock();
    if (!options_.quiet) print_live();
  }
}

/// All axes from one time: the reference's, as the steered clock knows it. Two by two on a circle.
void MainRunner::move_axes() {
  const bool moving = figures_.op_cycle >= 0 && options_.move;
  const double time = servo_->next_trigger().local.since_epoch().seconds();
  const bool all_enabled = std::all_of(
      axes_.begin(), axes_.end(),
      [](const ethercat::CspAxis& axis) { return axis.state() == ethercat::AxisState::kEnabled; });
  path_.advance(moving && all_enabled, time);
  for (std::size_t n = 0; n < axes_.size(); ++n) {
    const auto outputs = main_->outputs(n);
    const auto inputs = main_->inputs(n);
    if (outputs.size() < ethercat::csp::kOutputSize) continue;
    if (inputs.size() < ethercat::csp::kInputSize) continue;
    if (!main_->takes_part(n)) axes_[n].restart();
    const bool enabled = axes_[n].state() == ethercat::AxisState::kEnabled;
    axes_[n]
        .cycle(ethercat::csp::Inputs::decode(inputs),
               {.enable = moving && (enabled || path_.at_rest()),
                .reset_fault = figures_.cycles % 2 == 0,
                .displacement = path_.displacement(n)})
        .encode(outputs);
  }
}

/// From the frame's arrival at the reference to the SYNC0 that follows.
std::int64_t MainRunner::margin_ns(const CycleSample& sample) const {
  const auto cycle = options_.servo.cycle.count();
  const auto until_sync0 =
      static_cast<std::int64_t>(main_->sync0_start()) - sample.reference.since_epoch().rounded_ns();
  return ((until_sync0 % cycle) + cycle) % cycle;
}

void MainRunner::note(const CycleSample& sample, bool answered) {
  ++figures_.cycles;
  figures_.host_stalls += decision_.skipped;
  // SYNC0 comes sync0_phase of a cycle after the frame's own place, and again with each cycle.
  const double late = decision_.lateness.ns() / static_cast<double>(options_.servo.cycle.count());
  figures_.late_windows +=
      static_cast<std::uint64_t>(std::max(0.0, std::floor(late - options_.sync0_phase) + 1.0));
  if (answered && main_->last_cycle().inputs_valid) ++figures_.working_counter_right;
  const bool locked = decision_.state == CycleState::kLocked;
  if (locked && figures_.lock_cycle < 0) {
    figures_.lock_cycle = static_cast<std::int64_t>(figures_.cycles);
  }
  const bool used = decision_.verdict == CycleVerdict::kUsed;
  if (used) trace(sample);
  if (figures_.lock_cycle < 0) return;
  figures_.lateness.add(decision_.lateness.ns());
  if (decision_.verdict == CycleVerdict::kLate || decision_.verdict == CycleVerdict::kSlow) {
    ++figures_.excluded;
    return;
  }
  if (!used) return;
  ++figures_.judged;
  figures_.phase.add(decision_.phase_error.ns());
  figures_.wire_phase.add((decision_.lateness - decision_.phase_error).ns());
  figures_.round_trip.add((sample.received - sample.sent).ns());
  figures_.margin.add(static_cast<double>(margin_ns(sample)));
  const auto second = 1'000'000'000 / options_.servo.cycle.count();
  const bool settled = static_cast<std::int64_t>(figures_.cycles) > figures_.lock_cycle + second;
  if (settled && main_->complete() && main_->last_cycle().inputs_valid) {
    figures_.worst_difference_ns =
        std::max(figures_.worst_difference_ns, main_->last_cycle().difference_bound_ns);
  }
}

/// Before the lock too; and the second half of the run, for a servo that never locks.
void MainRunner::trace(const CycleSample& sample) {
  const double time_s = (sample.sent - start_).seconds();
  const double wire_ns = (decision_.lateness - decision_.phase_error).ns();
  if (time_s > options_.duration_s / 2) {
    figures_.second_half_phase.add(decision_.phase_error.ns());
    figures_.second_half_wire_phase.add(wire_ns);
  }
  if (figures_.trace.size() == figures_.trace.capacity()) return;
  figures_.trace.push_back({static_cast<float>(time_s), microseconds(decision_.phase_error.ns()),
                            microseconds(wire_ns), microseconds(decision_.lateness.ns()),
                            microseconds(static_cast<double>(margin_ns(sample))),
                            microseconds((sample.received - sample.sent).ns())});
}

/// OP once the cycle is locked; a SubDevice that left it is acknowledged and asked again.
void MainRunner::supervise() {
  if (figures_.op_cycle < 0 && main_->last_cycle().all_operational()) {
    figures_.op_cycle = static_cast<std::int64_t>(figures_.cycles);
  }
  if (decision_.state != CycleState::kLocked || main_->last_cycle().all_operational()) return;
  const bool first = asked_at_ == 0;
  if (first) main_->request_operational();
  if (first) asked_at_ = figures_.cycles;
  constexpr std::uint64_t kCyclesBetweenRecoveries = 100;
  const std::uint64_t since = figures_.cycles - asked_at_;
  if (since < kCyclesBetweenRequests || since % kCyclesBetweenRecoveries != 0) return;
  for (std::size_t n = 0; n < main_->network().count; ++n) main_->recover(n);
}

void MainRunner::record(RunEvent::Kind kind, std::size_t drive, ethercat::AlStatusCode code) {
  if (figures_.events.size() == figures_.events.capacity()) return;
  const double time_s = (HostClock::now() - start_).seconds();
  figures_.events.push_back({time_s, kind, static_cast<std::uint16_t>(drive), code});
}

void MainRunner::watch_lock() {
  using Change = LockWatch::Change;
  const Change change = figures_.lock.update(decision_.state == CycleState::kLocked);
  if (change == Change::kLocked) record(RunEvent::Kind::kLocked);
  if (change == Change::kLost) record(RunEvent::Kind::kLockLost);
  const bool followed = options_.servo.law != CycleLaw::kNone;
  if (followed && figures_.lock.without() >= unlocked_limit_) {
    main_->stop(ethercat::FailureKind::kSyncLost);
  }
}

/// From OP on: who leaves it, and why; who comes back.
void MainRunner::watch_drives() {
  if (figures_.op_cycle < 0) return;
  if (main_->counters().reintegrated != reintegrated_) {
    reintegrated_ = main_->counters().reintegrated;
    record(RunEvent::Kind::kReintegrated, reintegrating_);
  }
  reintegrating_ = main_->reintegrating();
  for (std::size_t n = 0; n < seen_.size(); ++n) {
    const ethercat::SubDeviceInfo& device = main_->network().devices[n];
    const Seen now = device.state == AlState::kOp     ? Seen::kInOp
                     : device.state == AlState::kNone ? Seen::kOutOfReach
                                                      : Seen::kLeftOp;
    // On its way back a drive passes the lower states.
    const bool on_its_way = now == Seen::kLeftOp && seen_[n] == Seen::kOutOfReach && !device.error;
    if (now == seen_[n] || on_its_way) continue;
    const bool first = seen_[n] == Seen::kNotYet;
    if (first && now != Seen::kInOp) continue;  // not yet asked
    seen_[n] = now;
    if (first) continue;
    record(now == Seen::kInOp         ? RunEvent::Kind::kBackInOp
           : now == Seen::kOutOfReach ? RunEvent::Kind::kOutOfReach
                                      : RunEvent::Kind::kLeftOp,
           n, device.code);
  }
}

/// Both positions are of one SYNC0. From the full radius on.
void MainRunner::watch_contour() {
  if (!path_.at_full() || axes_.size() < 2 || !main_->last_cycle().inputs_valid) return;
  const double cycle_s = static_cast<double>(options_.servo.cycle.count()) * 1e-9;
  const double radius = options_.radius * ethercat::DriveMotor::steady_gain(
                                              2.0 * std::numbers::pi * cycle_s / options_.turn_s);
  const auto at = [this](std::size_t n) {
    const std::int32_t position = ethercat::csp::Inputs::decode(main_->inputs(n)).position;
    return static_cast<double>(position - axes_[n].origin());
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

void MainRunner::print_live() const {
  const ethercat::CycleReport& report = main_->last_cycle();
  const double rate = decision_.rate.ratio();
  fmt::print(
      "margin {:7.1f} us  {:9} (first after {})  phase {:+8.3f} us  rate {:+9.3f} ppm  cycle "
      "{:.6f} ms  "
      "wkc {}/{}  al 0x{:02X}  |0x092C| < {} ns  lost {}  late {}\n",
      figures_.margin.quantile(0.5) * 1e-3, name(decision_.state), figures_.lock_cycle,
      decision_.phase_error.ns() * 1e-3, decision_.rate.ppm(),
      static_cast<double>(options_.servo.cycle.count()) * 1e-6 / rate, report.working_counter,
      report.expected, report.states, report.difference_bound_ns + 1, main_->counters().lost,
      servo_->counters().late);
  std::fflush(stdout);
}

}  // namespace ftcs::app
