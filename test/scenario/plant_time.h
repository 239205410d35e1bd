// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include "ftcs/experiment/two_machines_world.h"

namespace ftcs::experiment::test {

/// One machine of two_machines.h, its crystals up to 200 ppm off, switched on at any phase. The
/// grandmaster jumps by 20 us, later by a millisecond; is silent for ten seconds; comes back.
inline void live_through_it(node::BusMode mode, std::uint64_t seed) {
  TwoMachinesWorld world;
  world.crystal_ppm = 200.0;
  world.receiver_s = 4.0;
  PlantMachine machine(world, mode, true, seed, seed % 2);
  ASSERT_TRUE(machine.bring_up()) << seed;
  const node::CycleNode& node = machine.host().node();
  const auto cycles = [&machine](int count) {
    for (int i = 0; i < count; ++i) machine.cycle();
  };
  constexpr int kSecond = 1000;
  cycles(12 * kSecond);
  // Who has just lost its lock has it again within seconds.
  for (int i = 0; i < 10 && node.bus().state != BusClockState::kLocked; ++i) cycles(kSecond);
  EXPECT_EQ(node.bus().state, BusClockState::kLocked) << seed;
  EXPECT_TRUE(node.main().last_cycle().all_operational()) << seed;
  EXPECT_LT(std::abs(machine.error_ns(0, machine.host().now())), 1000.0) << seed;
  machine.receiver().step(Duration::from_ns(20'000.0));
  cycles(10 * kSecond);
  EXPECT_EQ(node.bus().state, BusClockState::kLocked) << seed;
  machine.receiver().set_silent(true);
  cycles(10 * kSecond);
  EXPECT_EQ(node.bus().state, BusClockState::kHoldover) << seed;
  machine.receiver().set_silent(false);
  machine.receiver().step(Duration::from_ns(1e6));
  cycles(5 * kSecond);
  EXPECT_TRUE(node.cyclic()) << seed;
  EXPECT_EQ(machine.faults(), 0U) << seed;
  for (std::size_t n = 0; n < TwoMachinesWorld::kDrives; ++n) {
    EXPECT_EQ(machine.segment()[n].drive().state(), ethercat::AlState::kOp) << seed;
    EXPECT_EQ(machine.segment()[n].drive().statistics().missed, 0U) << seed;
  }
}

}  // namespace ftcs::experiment::test
