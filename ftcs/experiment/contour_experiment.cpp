// SPDX-License-Identifier: MIT
#include "ftcs/experiment/contour_experiment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "ftcs/ethercat/maindevice/circle_path.h"
#include "ftcs/ethercat/maindevice/csp_axis.h"
#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/ethercat/subdevice/segment.h"
#include "ftcs/sim/random.h"

namespace ftcs::experiment {

namespace {

using ethercat::MainDevice;
using ethercat::WireTime;

constexpr Nanoseconds kCycle{1'000'000};
constexpr std::size_t kAxes = 2;
constexpr Nanoseconds kBringUpRoundTrip{20'000};
constexpr Nanoseconds kReplyTime{60'000};
/// 0x10F1:02 as a drive has it: two windows missed in a row are too many.
constexpr std::uint32_t kOwnLimit = 4;

constexpr std::array<std::pair<const char*, CycleLaw>, 4> kLaws{
    {{"no sync", CycleLaw::kNone},
     {"PICS", CycleLaw::kPics},
     {"FTCS", CycleLaw::kFtcs},
     {"adaptive", CycleLaw::kAdaptive}}};

CycleServoConfig servo_config(CycleLaw law) {
  CycleServoConfig config;
  config.law = law;
  config.cycle = kCycle;
  return config;
}

/// Two drives, a MainDevice, a host that is late; in simulated time.
class Machine {
 public:
  Machine(const ContourWorld& world, CycleLaw law, std::uint64_t seed, std::uint32_t limit)
      : world_(world),
        lateness_(seed, "lateness"),
        servo_(servo_config(law)),
        path_(world.radius_um, world.turn_s) {
    const auto objects = ethercat::csp_objects(kCycle);
    objects_.assign(objects.begin(), objects.end());
    objects_.push_back({{0x10F1, 2}, 2, limit});
    ethercat::MainDeviceConfig config;
    config.process.objects = objects_;
    config.process.cycle = kCycle;
    config.process.sync0_shift = kCycle / 2;
    main_ = std::make_unique<MainDevice>(config);
    segment_ = std::make_unique<ethercat::Segment>();
    crystals_[0].set_rate(Rate::from_ppm(world.reference_ppm), WireTime{});
    crystals_[1].set_rate(Rate::from_ppm(world.other_ppm), WireTime{});
    for (std::size_t n = 0; n < kAxes; ++n) {
      static_cast<void>(segment_->add({}, {.parent = static_cast<int>(n) - 1}, crystals_[n]));
    }
  }

  /// False: it did not come to the cyclic stage.
  [[nodiscard]] bool bring_up() {
    constexpr int kMostFrames = 100'000;
    for (int i = 0; i < kMostFrames && !main_->cyclic(); ++i) {
      if (main_->stage() == ethercat::Stage::kStopped) return false;
      exchange();
      now_ = now_ + kBringUpRoundTrip;
    }
    decision_ = servo_.start(host());
    return main_->cyclic();
  }

  void cycle() {
    constexpr double kLeast_us = 20.0;
    constexpr double kMost_us = 200.0;
    const double late_us =
        std::min(kLeast_us + world_.mean_lateness_us * lateness_.exponential(), kMost_us);
    const FreeRunningTime start = decision_.wake + Duration::from_ns(late_us * 1e3);
    now_ = WireTime{start.since_epoch()};
    move();
    CycleSample sample;
    sample.sent = start;
    const bool answered = exchange();
    sample.has_reference = answered && main_->last_cycle().has_reference;
    sample.reference = main_->last_cycle().reference;
    decision_ = servo_.update(sample, start + Duration{kReplyTime});
    ++cycles_;
    if (cycles_ == kCyclesToOp) main_->request_operational();
    if (main_->last_cycle().all_operational()) in_op_ = true;
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
  /// FTCS knows the rate after one interval of 500 cycles.
  static constexpr std::uint64_t kCyclesToOp = 1200;

  [[nodiscard]] FreeRunningTime host() const { return FreeRunningTime{now_.since_epoch()}; }
  [[nodiscard]] std::uint64_t sum(std::uint64_t ethercat::SyncStatistics::*field) const {
    std::uint64_t result = 0;
    for (std::size_t n = 0; n < kAxes; ++n) {
      result += (*segment_)[n].drive().statistics().*field;
    }
    return result;
  }
  bool exchange() {
    const ethercat::ConstBytes frame = main_->next_frame();
    if (frame.empty()) return false;
    std::copy(frame.begin(), frame.end(), buffer_.begin());
    const ethercat::Bytes bytes = ethercat::Bytes{buffer_}.first(frame.size());
    const auto view = ethercat::FrameView::parse(bytes);
    if (!view) return false;
    const auto passage = segment_->pass(*view, now_);
    const LocalTime sent{now_.since_epoch()};
    const auto outcome = main_->on_frame(bytes, {sent, LocalTime{passage.at.since_epoch()}});
    return outcome != ethercat::FrameOutcome::kIgnored;
  }
  void move() {
    const bool all = axes_[0].state() == ethercat::AxisState::kEnabled &&
                     axes_[1].state() == ethercat::AxisState::kEnabled;
    path_.advance(in_op_ && all, servo_.next_trigger().local.since_epoch().seconds());
    for (std::size_t n = 0; n < kAxes; ++n) {
      const bool enabled = axes_[n].state() == ethercat::AxisState::kEnabled;
      axes_[n]
          .cycle(ethercat::csp::Inputs::decode(main_->inputs(n)),
                 {.enable = in_op_ && (enabled || path_.at_rest()),
                  .displacement = path_.displacement(n)})
          .encode(main_->outputs(n));
    }
  }

  const ContourWorld& world_;
  sim::RandomStream lateness_;
  CycleServo servo_;
  ethercat::CirclePath path_;
  std::vector<ethercat::SdoDownload> objects_;
  std::unique_ptr<MainDevice> main_;
  std::unique_ptr<ethercat::Segment> segment_;
  std::array<ethercat::AffineOscillator, kAxes> crystals_;
  std::array<ethercat::CspAxis, kAxes> axes_;
  std::array<std::uint8_t, ethercat::kMaxFrameSize> buffer_{};
  WireTime now_ = WireTime::from_ns(1'000'000);
  CycleDecision decision_;
  std::uint64_t cycles_ = 0;
  bool in_op_ = false;
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
