// SPDX-License-Identifier: MIT
#include "ftcs/experiment/contour_experiment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "ftcs/sim/cycle_host.h"
#include "ftcs/sim/drives/segment.h"
#include "ftcs/sim/random.h"

namespace ftcs::experiment {

namespace {

using ethercat::WireTime;

constexpr Nanoseconds kCycle{1'000'000};
constexpr std::size_t kAxes = 2;
/// 0x10F1:02 as a drive has it: two windows missed in a row are too many.
constexpr std::uint16_t kOwnLimit = 4;

constexpr std::array<std::pair<const char*, CycleLaw>, 4> kLaws{
    {{"no sync", CycleLaw::kNone},
     {"PICS", CycleLaw::kPics},
     {"FTCS", CycleLaw::kFtcs},
     {"adaptive", CycleLaw::kAdaptive}}};

node::CycleNodeConfig node_config(const ContourWorld& world, CycleLaw law, std::uint16_t limit) {
  node::CycleNodeConfig config;
  config.servo.law = law;
  config.servo.cycle = kCycle;
  config.sync_error_limit = limit;
  config.axes.radius = world.radius_um;
  config.axes.turn_s = world.turn_s;
  return config;
}

/// Two drives and a host that is late, in simulated time.
class Machine {
 public:
  Machine(const ContourWorld& world, CycleLaw law, std::uint64_t seed, std::uint16_t limit)
      : world_(world),
        lateness_(seed, "lateness"),
        segment_(std::make_unique<ethercat::Segment>()),
        host_(node_config(world, law, limit), *segment_, WireTime::from_ns(1'000'000)) {
    crystals_[0].set_rate(Rate::from_ppm(world.reference_ppm), WireTime{});
    crystals_[1].set_rate(Rate::from_ppm(world.other_ppm), WireTime{});
    for (std::size_t n = 0; n < kAxes; ++n) {
      static_cast<void>(segment_->add({}, {.parent = static_cast<int>(n) - 1}, crystals_[n]));
    }
  }

  /// False: it did not come to the cyclic stage.
  [[nodiscard]] bool bring_up() { return host_.bring_up(); }

  void cycle() {
    constexpr double kLeastUs = 20.0;
    constexpr double kMostUs = 200.0;
    const double late_us =
        std::min(kLeastUs + world_.mean_lateness_us * lateness_.exponential(), kMostUs);
    host_.cycle(Duration::from_ns(late_us * 1e3));
  }

  /// Off the circle that the position loops draw with perfect timing, um.
  [[nodiscard]] double contour_error() const {
    const double cycle_s = static_cast<double>(kCycle.count()) * 1e-9;
    const double radius = world_.radius_um * ethercat::DriveMotor::steady_gain(
                                                 2.0 * std::numbers::pi * cycle_s / world_.turn_s);
    const auto at = [this](std::size_t n) {
      return static_cast<double>((*segment_)[n].drive().motor().position());
    };
    return std::hypot(at(0), at(1)) - radius;
  }
  [[nodiscard]] std::uint64_t windows() const { return sum(&ethercat::SyncStatistics::events); }
  [[nodiscard]] std::uint64_t missed() const { return sum(&ethercat::SyncStatistics::missed); }
  [[nodiscard]] bool faulted() const {
    return !(*segment_)[0].drive().faults().empty() || !(*segment_)[1].drive().faults().empty();
  }

 private:
  [[nodiscard]] std::uint64_t sum(std::uint64_t ethercat::SyncStatistics::*field) const {
    std::uint64_t result = 0;
    for (std::size_t n = 0; n < kAxes; ++n) {
      result += (*segment_)[n].drive().statistics().*field;
    }
    return result;
  }

  const ContourWorld& world_;
  sim::RandomStream lateness_;
  std::unique_ptr<ethercat::Segment> segment_;
  std::array<ethercat::AffineOscillator, kAxes> crystals_;
  sim::CycleHost host_;
};

int cycles_in(double seconds) {
  return static_cast<int>(seconds * 1e9 / static_cast<double>(kCycle.count()));
}

void draw_circle(const ContourWorld& world, CycleLaw law, std::uint64_t seed, ContourRow& row) {
  Machine machine(world, law, seed, 0);
  if (!machine.bring_up()) return;
  for (int i = 0; i < cycles_in(world.settling_s); ++i) machine.cycle();
  const std::uint64_t missed_before = machine.missed();
  const std::uint64_t windows_before = machine.windows();
  double squares = 0.0;
  double group = 0.0;
  const int measured = cycles_in(world.measured_s);
  for (int i = 0; i < measured; ++i) {
    machine.cycle();
    const double error = std::abs(machine.contour_error());
    squares += error * error;
    row.max_um = std::max(row.max_um, error);
    group = std::max(group, error);
    if (i % ContourRow::kTraceGroup != ContourRow::kTraceGroup - 1) continue;
    row.trace_um.push_back(group);
    group = 0.0;
  }
  row.rms_um = std::sqrt(squares / std::max(measured, 1));
  row.missed_windows = machine.missed() - missed_before;
  row.windows = machine.windows() - windows_before;
}

void find_first_fault(const ContourWorld& world, CycleLaw law, std::uint64_t seed,
                      ContourRow& row) {
  Machine machine(world, law, seed, kOwnLimit);
  if (!machine.bring_up()) return;
  const int all = cycles_in(world.settling_s + world.measured_s);
  for (int i = 0; i < all && !machine.faulted(); ++i) {
    machine.cycle();
    if (machine.faulted()) {
      row.first_fault_s = static_cast<double>(i) * static_cast<double>(kCycle.count()) * 1e-9;
    }
  }
}

}  // namespace

ContourRow run_contour(const ContourWorld& world, CycleLaw law, std::uint64_t seed) {
  ContourRow row;
  const auto* const entry = std::find_if(kLaws.begin(), kLaws.end(),
                                         [law](const auto& pair) { return pair.second == law; });
  row.servo = entry->first;
  draw_circle(world, law, seed, row);
  find_first_fault(world, law, seed, row);
  return row;
}

ContourResult run_contours(const ContourWorld& world, std::uint64_t seed,
                           const JobControl& control) {
  ContourResult result;
  result.world = world;
  result.seed = seed;
  result.rows.resize(kLaws.size());
  run_jobs(kLaws.size(), control, [&result, &world, seed](std::size_t i) {
    result.rows[i] = run_contour(world, kLaws[i].second, seed);
  });
  return result;
}

}  // namespace ftcs::experiment
