// SPDX-License-Identifier: MIT
#include "ftcs/experiment/two_machines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "ftcs/experiment/two_machines_world.h"

namespace ftcs::experiment {

namespace {

using ethercat::WireTime;

constexpr std::array kModes{MachineMode::kNone, MachineMode::kLead, MachineMode::kExternal,
                            MachineMode::kOne};
/// The contour error on two machines may be so much larger than that on one.
constexpr double kContourShare = 1.1;

node::BusMode bus_mode(MachineMode mode) {
  if (mode == MachineMode::kLead) return node::BusMode::kLead;
  return mode == MachineMode::kExternal ? node::BusMode::kExternal : node::BusMode::kFollow;
}

/// Where an axis is so long after its own last SYNC0, on the line through its last two positions.
class AxisTruth {
 public:
  [[nodiscard]] double later(PlantMachine& machine, std::size_t drive, double share_of_cycle) {
    const double position = machine.segment()[drive].drive().motor().position();
    const double result = position + (position - last_) * share_of_cycle;
    last_ = position;
    return result;
  }

 private:
  double last_ = 0.0;
};

/// Both machines cycle by cycle, and what is true between.
class TwoMachines {
 public:
  TwoMachines(const TwoMachinesWorld& world, MachineMode mode, std::uint64_t seed)
      : world_(world),
        mode_(mode),
        a_(world, bus_mode(mode), plant(), seed, 0),
        b_(world, bus_mode(mode), plant(), seed, 1) {}

  TwoMachinesRun run() {
    TwoMachinesRun result;
    result.up = a_.bring_up() && b_.bring_up();
    if (!result.up) return result;
    const double cycle_s = static_cast<double>(world_.cycle.count()) * 1e-9;
    const auto first = static_cast<std::int64_t>((world_.receiver_s + 1.0) / cycle_s);
    const auto from = static_cast<std::int64_t>((world_.receiver_s + world_.settling_s) / cycle_s);
    const auto end = from + static_cast<std::int64_t>(world_.measured_s / cycle_s);
    for (std::int64_t k = first; k < end; ++k) {
      // The middle of the cycle: SYNC0, where there is plant time.
      const WireTime nominal =
          WireTime::from_ns(k * world_.cycle.count()) + Duration{world_.cycle}.half();
      cycle_until(a_, nominal);
      cycle_until(b_, nominal);
      look(nominal, k >= from);
    }
    summarise(result);
    return result;
  }

 private:
  [[nodiscard]] bool plant() const {
    return mode_ == MachineMode::kLead || mode_ == MachineMode::kExternal;
  }
  static void cycle_until(PlantMachine& machine, WireTime instant) {
    while (machine.host().instant_of(machine.host().node().decision().wake) < instant) {
      machine.cycle();
    }
  }
  void look(WireTime nominal, bool counts) {
    std::array<double, 2> first{};
    for (std::size_t n = 0; n < TwoMachinesWorld::kDrives; ++n) {
      const double a = a_.error_ns(n, nominal);
      const double b = b_.error_ns(n, nominal);
      if (n == 0) first = {a, b};
      const double cycle = static_cast<double>(world_.cycle.count());
      // Of one machine it is two drives of the same segment.
      double apart = mode_ == MachineMode::kOne ? a - a_.error_ns(1, nominal) : a - b;
      apart -= cycle * std::round(apart / cycle);
      if (counts) note_sync0(apart);
    }
    draw(counts);
    last_error_ = first;
    if (counts && plant()) {
      const double wrong = a_.host().node().bus().dc_to_plant.ns() - first[0];
      told_squares_ += wrong * wrong;
    }
  }
  void note_sync0(double apart) {
    squares_ += apart * apart;
    worst_ = std::max(worst_, std::abs(apart));
    ++count_;
  }
  /// The motors show what they were told at the last SYNC0.
  void draw(bool counts) {
    const double cycle_ns = static_cast<double>(world_.cycle.count());
    const bool one = mode_ == MachineMode::kOne;
    PlantMachine& second = one ? a_ : b_;
    // Both at the SYNC0 of the first: a clock that is ahead has its SYNC0 early.
    const double apart = one ? 0.0 : last_error_[1] - last_error_[0];
    const double x = x_.later(a_, 0, 0.0);
    const double y = y_.later(second, 1, apart / cycle_ns);
    if (!counts) return;
    const double gain =
        ethercat::DriveMotor::steady_gain(2.0 * std::numbers::pi * cycle_ns * 1e-9 / world_.turn_s);
    const double error = std::hypot(x, y) - world_.radius_um * gain;
    contour_squares_ += error * error;
    contour_worst_ = std::max(contour_worst_, std::abs(error));
    ++drawn_;
    if (static_cast<double>(drawn_) * cycle_ns * 1e-9 <= world_.turn_s) {
      circle_.push_back({std::atan2(y, x), error});
    }
  }
  void summarise(TwoMachinesRun& result) {
    result.sync0_rms_ns = std::sqrt(squares_ / static_cast<double>(std::max(count_, 1)));
    result.sync0_worst_ns = worst_;
    result.contour_rms_um = std::sqrt(contour_squares_ / static_cast<double>(std::max(drawn_, 1)));
    result.contour_worst_um = contour_worst_;
    result.told_rms_ns = std::sqrt(told_squares_ / static_cast<double>(std::max(drawn_, 1)));
    result.circle = circle_;
    for (PlantMachine* machine : {&a_, &b_}) {
      result.faults += machine->faults();
      for (std::size_t n = 0; n < TwoMachinesWorld::kDrives; ++n) {
        result.missed_windows += machine->segment()[n].drive().statistics().missed;
      }
    }
  }

  const TwoMachinesWorld& world_;
  MachineMode mode_;
  PlantMachine a_;
  PlantMachine b_;
  AxisTruth x_;
  AxisTruth y_;
  std::array<double, 2> last_error_{};
  double squares_ = 0.0;
  double worst_ = 0.0;
  double contour_squares_ = 0.0;
  double contour_worst_ = 0.0;
  double told_squares_ = 0.0;
  std::vector<CirclePoint> circle_;
  int count_ = 0;
  int drawn_ = 0;
};

/// Steady variance (ns^2) of the offset that a Kalman filter of offset and rate reaches with
/// samples of variance r (ns^2) each dt seconds and random-walk FM of q (ns/s)^2 per second.
double kalman_variance(double r, double q, double dt) {
  double xx = 1e6;
  double xy = 0.0;
  double yy = 1e6;
  constexpr int kSteps = 200'000;
  for (int i = 0; i < kSteps; ++i) {
    xx += 2.0 * xy * dt + yy * dt * dt + q * dt * dt * dt / 3.0;
    xy += yy * dt + q * dt * dt / 2.0;
    yy += q * dt;
    const double gain_x = xx / (xx + r);
    const double gain_y = xy / (xx + r);
    yy -= gain_y * xy;
    xy -= gain_y * xx;
    xx -= gain_x * xx;
  }
  return xx;
}

template <class Field>
void take(TwoMachinesRow& row, const std::vector<TwoMachinesRun>& runs, Field field) {
  std::vector<double> values;
  values.reserve(runs.size());
  for (const TwoMachinesRun& run : runs) values.push_back(run.*field);
  std::sort(values.begin(), values.end());
  row.median.*field = values[values.size() / 2];
  row.worst.*field = values.back();
}

TwoMachinesRow row_of(MachineMode mode, const std::vector<TwoMachinesRun>& runs) {
  TwoMachinesRow row;
  row.mode = mode;
  if (mode == MachineMode::kExternal) row.demanded_rms_ns = 50.0;
  if (mode == MachineMode::kExternal) row.demanded_worst_ns = 200.0;
  if (mode == MachineMode::kLead) row.demanded_rms_ns = 100.0;
  if (mode == MachineMode::kLead) row.demanded_worst_ns = 500.0;
  take(row, runs, &TwoMachinesRun::sync0_rms_ns);
  take(row, runs, &TwoMachinesRun::sync0_worst_ns);
  take(row, runs, &TwoMachinesRun::contour_rms_um);
  take(row, runs, &TwoMachinesRun::contour_worst_um);
  take(row, runs, &TwoMachinesRun::told_rms_ns);
  row.circle = runs.front().circle;
  std::sort(row.circle.begin(), row.circle.end(),
            [](const CirclePoint& a, const CirclePoint& b) { return a.angle_rad < b.angle_rad; });
  row.median.up = row.worst.up = true;
  for (const TwoMachinesRun& run : runs) {
    row.worst.up = row.worst.up && run.up;
    row.worst.faults = std::max(row.worst.faults, run.faults);
    row.worst.missed_windows = std::max(row.worst.missed_windows, run.missed_windows);
  }
  return row;
}

/// All seeds, not their median.
void judge(TwoMachinesRow& row, double contour_of_one) {
  row.passed = row.worst.up && row.worst.faults == 0;
  if (row.demanded_rms_ns <= 0.0) return;
  row.passed = row.passed && row.worst.sync0_rms_ns <= row.demanded_rms_ns &&
               row.worst.sync0_worst_ns <= row.demanded_worst_ns &&
               row.median.contour_rms_um <= kContourShare * contour_of_one;
}

}  // namespace

const char* name(MachineMode mode) noexcept {
  switch (mode) {
    case MachineMode::kNone:
      return "none";
    case MachineMode::kLead:
      return "lead";
    case MachineMode::kExternal:
      return "external";
    case MachineMode::kOne:
      return "one";
  }
  return "unknown";
}

bool TwoMachinesResult::passed() const noexcept {
  return std::all_of(rows.begin(), rows.end(),
                     [](const TwoMachinesRow& row) { return row.passed; });
}

TwoMachinesRun run_two_machines(const TwoMachinesWorld& world, MachineMode mode,
                                std::uint64_t seed) {
  return TwoMachines(world, mode, seed).run();
}

double kalman_sync0_rms_ns(const TwoMachinesWorld& world) {
  constexpr double kTickVariance = 1.0 / 12.0;
  constexpr double kEscTick = 10.0;  // ns
  const double cycle_s = static_cast<double>(world.cycle.count()) * 1e-9;
  const double q = world.wander * world.wander * 1e18;
  const double stamp = world.stamp_tick_ns * world.stamp_tick_ns * kTickVariance;
  const double esc = kEscTick * kEscTick * kTickVariance;
  // Two stamps make a sample, and a Sync and a request come in each interval.
  const double receiver = kalman_variance(2.0 * stamp, q, world.sync_interval_s / 2.0);
  const double frame = world.frame_stamp_ns * world.frame_stamp_ns + esc;
  const double bus = kalman_variance(frame, q, cycle_s);
  // Two machines, and the tick of each clock that is compared.
  return std::sqrt(2.0 * (receiver + bus + esc));
}

TwoMachinesResult run_two_machines_table(const TwoMachinesWorld& world, std::uint64_t seeds,
                                         const JobControl& control) {
  TwoMachinesResult result;
  result.world = world;
  result.seeds = seeds;
  result.kalman_rms_ns = kalman_sync0_rms_ns(world);
  std::vector<TwoMachinesRun> runs(kModes.size() * seeds);
  const std::size_t done = run_jobs(runs.size(), control, [&](std::size_t i) {
    runs[i] = run_two_machines(world, kModes[i / seeds], i % seeds + 1);
  });
  if (done < runs.size()) return result;
  for (std::size_t m = 0; m < kModes.size(); ++m) {
    const auto begin = runs.begin() + static_cast<std::ptrdiff_t>(m * seeds);
    result.rows.push_back(row_of(kModes[m], {begin, begin + static_cast<std::ptrdiff_t>(seeds)}));
  }
  for (TwoMachinesRow& row : result.rows) judge(row, result.rows.back().median.contour_rms_um);
  return result;
}

}  // namespace ftcs::experiment
