// SPDX-License-Identifier: MIT
// The world of test/cycle_world.h.
#include "ftcs/discipline/cycle_servo.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "test/support/cycle_world.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {

using test::config_of;
using test::EachLaw;
using test::kCycle;
using test::rate_tolerance_ppm;
using test::World;

INSTANTIATE_TEST_SUITE_P(Laws, EachLaw,
                         ::testing::Values(CycleLaw::kFtcs, CycleLaw::kPics, CycleLaw::kAdaptive));

TEST_P(EachLaw, locks_and_keeps_the_virtual_trigger_in_phase) {
  World world(config_of(GetParam()));
  world.run(600);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  EXPECT_NEAR(world.decision.rate.ppm(), 50.0, rate_tolerance_ppm(GetParam()));
  EXPECT_LT(world.rms(2000), 500.0);
}

TEST_P(EachLaw, stands_on_the_same_phase_after_each_start) {
  for (std::int64_t start = 0; start < 1'000'000; start += 173'000) {
    CycleServoConfig config = config_of(GetParam());
    config.shift = Nanoseconds{250'000};
    World world(config);
    world.start += start;
    world.run(700);
    EXPECT_NEAR(world.true_error(), 0.0, 2000.0) << "start " << start;
  }
}

TEST_P(EachLaw, removes_any_phase_itself_when_it_may_not_jump) {
  for (std::int64_t start = 0; start < 1'000'000; start += 173'000) {
    CycleServoConfig config = config_of(GetParam());
    config.align_at_start = false;
    World world(config);
    world.start += start;
    FreeRunningTime before = world.decision.virtual_instant;
    for (int i = 0; i < 700; ++i) {
      world.cycle();
      const double length = (world.decision.virtual_instant - before).ns();
      before = world.decision.virtual_instant;
      ASSERT_NEAR(length, 1e6, 1.02e4) << "a cycle bent by more than F";
    }
    EXPECT_EQ(world.decision.state, CycleState::kLocked);
    EXPECT_NEAR(world.true_error(), 0.0, 2000.0) << "start " << start;
  }
}

TEST_P(EachLaw, a_lateness_of_the_wrong_sign_ruins_it) {
  World world(config_of(GetParam()));
  world.falsify_lateness = true;
  world.run(600);
  EXPECT_GT(world.rms(1000), 20'000.0);
}

TEST_P(EachLaw, an_error_of_the_wrong_sign_diverges) {
  CycleServoConfig config = config_of(GetParam());
  config.align_at_start = false;
  World world(config);
  world.mirror_reference = true;
  world.run(3000);
  EXPECT_NE(world.decision.state, CycleState::kLocked);
  EXPECT_GT(world.servo.counters().resyncs + world.servo.counters().impossible, 0U);
}

TEST_P(EachLaw, follows_a_step_of_the_rate_without_a_false_lock) {
  World world(config_of(GetParam()));
  world.run(1000);
  world.set_ppm(150.0);
  int unlocked_or_close = 0;
  for (int i = 0; i < 1500; ++i) {
    world.cycle();
    // Whoever says it is locked must be within the band that it may leave.
    const bool honest =
        world.decision.state != CycleState::kLocked || std::abs(world.true_error()) < 21'000.0;
    unlocked_or_close += honest ? 1 : 0;
  }
  EXPECT_EQ(unlocked_or_close, 1500);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  EXPECT_NEAR(world.decision.rate.ppm(), 150.0, rate_tolerance_ppm(GetParam()));
}

TEST_P(EachLaw, a_reference_that_starts_anew_is_found_again) {
  World world(config_of(GetParam()));
  world.run(700);
  world.jump = -Nanoseconds{500'000'333'000};
  world.run(2);
  EXPECT_EQ(world.decision.verdict, CycleVerdict::kImpossible);
  world.run(700);
  EXPECT_EQ(world.servo.counters().resyncs, 1U);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  EXPECT_NEAR(world.true_error(), 0.0, 2000.0);
}

TEST_P(EachLaw, silence_is_coasted_and_then_said) {
  World world(config_of(GetParam()));
  world.run(2000);
  for (int i = 0; i < 1999; ++i) world.cycle(true);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  EXPECT_LT(std::abs(world.true_error()), 20'000.0) << "the rate was kept for two seconds";
  world.cycle(true);
  EXPECT_EQ(world.decision.state, CycleState::kCoasting);
  world.run(300);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
}

TEST_P(EachLaw, a_coarse_timer_is_no_noise_when_its_rounding_is_known) {
  CycleServoConfig config = config_of(GetParam());
  config.resolution = Nanoseconds{10'000};
  World world(config);
  world.run(700);
  double event = 0;
  double virtual_error = 0;
  for (int i = 0; i < 2000; ++i) {
    world.cycle();
    EXPECT_EQ(world.decision.wake.since_epoch().rounded_ns() % 10'000, 0);
    const double rounding = (world.decision.wake - world.decision.virtual_instant).ns();
    virtual_error += world.true_error() * world.true_error();
    event += (world.true_error() - rounding) * (world.true_error() - rounding);
  }
  EXPECT_LT(std::sqrt(virtual_error / 2000), 500.0);
  EXPECT_NEAR(std::sqrt(event / 2000), 10'000.0 / std::sqrt(12.0), 200.0);
}

TEST_P(EachLaw, a_frame_that_comes_back_in_the_next_cycle_serves_as_well) {
  World world(config_of(GetParam()));
  world.a_cycle_behind = true;
  world.run(700);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  EXPECT_LT(world.rms(2000), 500.0);
  EXPECT_EQ(world.servo.counters().skipped, 0U);
  for (int i = 0; i < 2000; ++i) {
    if (i % 500 == 250) world.stall = Nanoseconds{5'000'000};
    world.cycle(i % 20 == 3);
    ASSERT_LT(std::abs(world.true_error()), 3000.0) << "cycle " << i;
  }
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  EXPECT_EQ(world.servo.counters().late, 4U);
}

TEST(CycleServo, the_lock_has_hysteresis) {
  CycleServoConfig config = config_of(CycleLaw::kNone);
  World world(config);
  world.ppm = 0.0;
  world.stamp_noise = 0.0;
  world.run(19);
  EXPECT_EQ(world.decision.state, CycleState::kAcquiring) << "twenty cycles in a row are asked for";
  world.run(1);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  world.jump = Nanoseconds{15'000};  // between enter (5 us) and leave (20 us)
  world.run(100);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  world.jump = Nanoseconds{21'000};  // five in a row are no bad stamps
  world.run(4);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
  world.run(1);
  EXPECT_EQ(world.decision.state, CycleState::kAcquiring);
  world.jump = Nanoseconds{15'000};
  world.run(100);
  EXPECT_EQ(world.decision.state, CycleState::kAcquiring);
  world.jump = Nanoseconds{0};
  world.run(20);
  EXPECT_EQ(world.decision.state, CycleState::kLocked);
}

/// What PICS sees at its first sync points when it starts 100 us away, ns.
std::array<double, 8> errors_of_pics(std::uint32_t cycles_per_sync) {
  CycleServoConfig config = config_of(CycleLaw::kPics);
  config.cycles_per_sync = cycles_per_sync;
  config.proportional_gain = 0.5;
  config.integral_gain = 0.3;
  config.align_at_start = false;
  config.largest_lateness = {};
  World world(config);
  world.ppm = 0.0;
  world.stamp_noise = 0.0;
  // The first trigger stands 100 us before the grid of the reference.
  const std::int64_t at =
      world.reference_at(world.decision.virtual_instant).since_epoch().rounded_ns();
  world.start -= (at + 100'000) % kCycle.count();
  std::array<double, 8> errors{};
  for (std::size_t n = 0; n < errors.size();) {
    world.cycle();
    if (world.decision.commanded) errors[n++] = world.decision.phase_error.ns();
  }
  return errors;
}

TEST(CycleServo, gains_of_pics_do_not_depend_on_the_cycles_per_interval) {
  const auto coarse = errors_of_pics(50);
  const auto fine = errors_of_pics(500);
  EXPECT_NEAR(coarse[0], 100'000.0, 1'000.0);
  EXPECT_LT(std::abs(coarse[7]), 20'000.0);
  for (std::size_t n = 0; n < coarse.size(); ++n) {
    EXPECT_NEAR(coarse[n], fine[n], 0.03 * 100'000.0) << "sync interval " << n;
  }
}

TEST(CycleServo, the_adaptive_law_locks_within_fifty_cycles) {
  CycleServoConfig config = config_of(CycleLaw::kAdaptive);
  config.lock.dwell = 20;
  World world(config);
  int cycles = 0;
  while (world.decision.state != CycleState::kLocked && cycles < 1000) {
    world.cycle();
    ++cycles;
  }
  EXPECT_LE(cycles, 50);
}

TEST(CycleServo, ftcs_locks_within_three_sync_intervals) {
  World world(config_of(CycleLaw::kFtcs));
  int last_bad = 0;
  for (int i = 0; i < 1000; ++i) {
    world.cycle();
    if (std::abs(world.true_error()) > 5000.0) last_bad = i;
  }
  EXPECT_LE(last_bad, 3 * 100);
}

TEST(CycleServo, the_rate_comes_from_whole_reference_time_so_that_no_cycle_slips) {
  // A host 5 % off per cycle in phase terms would alias if k(n) came from the phase alone: with 20
  // cycles per interval a slip of one cycle looks like no error at all.
  CycleServoConfig config = config_of(CycleLaw::kFtcs);
  config.cycles_per_sync = 20;
  World world(config);
  world.run(500);
  const ReferenceTime before = world.reference_at(world.decision.virtual_instant);
  world.run(1000);
  const Duration elapsed = world.reference_at(world.decision.virtual_instant) - before;
  EXPECT_NEAR(elapsed.ns(), 1000.0 * static_cast<double>(kCycle.count()), 20'000.0);
}

TEST(CycleServo, touches_no_heap) {
  World world(config_of(CycleLaw::kAdaptive));
  const test::ForbidAllocation guard;
  world.run(100);
}

}  // namespace
}  // namespace ftcs
