// SPDX-License-Identifier: MIT
// The world: machines of two_machines.h, their crystals up to 200 ppm off, switched on at any
// phase. When the drives are in OP, something happens to plant time: the grandmaster jumps, is
// silent, is silent and jumps, or is reached another way.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/experiment/parallel.h"
#include "ftcs/experiment/two_machines_world.h"

namespace ftcs::experiment {
namespace {

constexpr int kSecond = 1000;  ///< cycles

struct Start {
  bool up = false;
  bool locked = false;    ///< on plant time, and all in OP, before something happened
  bool in_op = false;     ///< all, at the end
  double error_ns = 0.0;  ///< true, when locked
  std::uint64_t faults = 0;
  std::uint64_t missed = 0;
  double largest_increment_ns = 0.0;  ///< of 0x0920 from one frame to the next
};

class Life {
 public:
  explicit Life(std::uint64_t seed)
      : seed_(seed),
        draw_(seed, "what happens"),
        machine_(world(), seed % 2 == 0 ? node::BusMode::kLead : node::BusMode::kExternal, true,
                 seed, seed / 2 % 2) {}

  Start live() {
    Start result;
    result.up = machine_.bring_up();
    if (!result.up) return result;
    for (int i = 0; i < 12 && !on_plant_time(); ++i) cycles(kSecond);
    cycles(kSecond);
    result.locked = on_plant_time();
    result.error_ns = machine_.error_ns(0, machine_.host().now());
    happen();
    cycles(4 * kSecond);
    return with_counts(result);
  }
  /// Plant time stays away for so long.
  Start live_through_silence(int seconds) {
    Start result;
    result.up = machine_.bring_up();
    if (!result.up) return result;
    cycles(15 * kSecond);
    machine_.receiver().set_silent(true);
    for (int i = 0; i < seconds; ++i) cycles(kSecond);
    EXPECT_EQ(node().bus().state, BusClockState::kHoldover) << seed_;
    machine_.receiver().set_silent(false);
    for (int i = 0; i < 60 && !on_plant_time(); ++i) cycles(kSecond);
    result.locked = on_plant_time();
    result.error_ns = machine_.error_ns(0, machine_.host().now());
    return with_counts(result);
  }

 private:
  static const TwoMachinesWorld& world() {
    static const TwoMachinesWorld world = [] {
      TwoMachinesWorld result;
      result.crystal_ppm = 200.0;
      result.receiver_s = 4.0;
      return result;
    }();
    return world;
  }
  [[nodiscard]] const node::CycleNode& node() { return machine_.host().node(); }
  [[nodiscard]] bool on_plant_time() {
    return node().bus().state == BusClockState::kLocked &&
           node().main().last_cycle().all_operational();
  }
  void cycles(int count) {
    for (int i = 0; i < count; ++i) {
      machine_.cycle();
      const std::int64_t offset = node().bus().offset_ns;
      largest_ns_ = std::max(largest_ns_, std::abs(static_cast<double>(offset - offset_ns_)));
      offset_ns_ = offset;
    }
  }
  /// From a microsecond to a tenth of a second, either way.
  [[nodiscard]] Duration jump() {
    const double size_ns = std::pow(10.0, 3.0 + 5.0 * draw_.uniform());
    return Duration::from_ns(draw_.chance(0.5) ? size_ns : -size_ns);
  }
  void happen() {
    PlantReceiver& receiver = machine_.receiver();
    const auto kind = seed_ / 4 % 4;
    if (kind == 0) receiver.step(jump());
    if (kind == 1 || kind == 2) {
      receiver.set_silent(true);
      cycles(3 * kSecond);
      receiver.set_silent(false);
    }
    if (kind == 2) receiver.step(jump());
    if (kind == 3) {
      const double longer_ns = 50'000.0 * draw_.uniform();
      const double asymmetry_ns = 1000.0 * draw_.uniform();
      receiver.take_another_path(Duration::from_ns(longer_ns),
                                 Duration::from_ns(longer_ns + asymmetry_ns));
    }
  }
  [[nodiscard]] Start with_counts(Start result) {
    result.in_op = node().main().last_cycle().all_operational();
    result.faults = machine_.faults();
    result.largest_increment_ns = largest_ns_;
    for (std::size_t n = 0; n < TwoMachinesWorld::kDrives; ++n) {
      result.missed += machine_.segment()[n].drive().statistics().missed;
    }
    return result;
  }

  std::uint64_t seed_;
  sim::RandomStream draw_;
  PlantMachine machine_;
  std::int64_t offset_ns_ = 0;
  double largest_ns_ = 0.0;
};

void expect_unharmed(const Start& start, std::size_t seed) {
  EXPECT_TRUE(start.up) << seed;
  EXPECT_TRUE(start.locked) << seed;
  EXPECT_LT(std::abs(start.error_ns), 1000.0) << seed;
  EXPECT_TRUE(start.in_op) << seed;
  EXPECT_EQ(start.faults, 0U) << seed;
  EXPECT_EQ(start.missed, 0U) << seed;
  // 400 ppm of a cycle, and the rounding of the register.
  EXPECT_LE(start.largest_increment_ns, 401.0) << seed;
}

TEST(PlantTime, moves_no_drive_into_a_fault_in_a_thousand_starts) {
  std::vector<Start> starts(1000);
  const std::size_t done =
      run_jobs(starts.size(), {}, [&](std::size_t i) { starts[i] = Life(i + 1).live(); });
  ASSERT_EQ(done, starts.size());
  for (std::size_t i = 0; i < starts.size(); ++i) expect_unharmed(starts[i], i + 1);
}

TEST(PlantTime, comes_back_after_an_hour_without_a_jump_in_the_drives) {
  constexpr int kHour = 3600;
  std::vector<Start> starts(2);
  run_jobs(starts.size(), {},
           [&](std::size_t i) { starts[i] = Life(i + 1).live_through_silence(kHour); });
  for (std::size_t i = 0; i < starts.size(); ++i) expect_unharmed(starts[i], i + 1);
}

}  // namespace
}  // namespace ftcs::experiment
