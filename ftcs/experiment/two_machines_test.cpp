// SPDX-License-Identifier: MIT
// The world: two_machines.h's, one seed.
#include "ftcs/experiment/two_machines.h"

#include <gtest/gtest.h>

#include "ftcs/experiment/two_machines_world.h"
#include "ftcs/time/relabel.h"

namespace ftcs::experiment {
namespace {

TwoMachinesWorld world() {
  TwoMachinesWorld result;
  result.measured_s = 3.0;
  return result;
}

TEST(TwoMachines, run_apart_without_plant_time) {
  const TwoMachinesRun run = run_two_machines(world(), MachineMode::kNone, 1);
  ASSERT_TRUE(run.up);
  EXPECT_GT(run.sync0_rms_ns, 10'000.0);
  EXPECT_GT(run.contour_rms_um, 10.0);
  EXPECT_EQ(run.faults, 0U) << "each is in phase with its own drives";
}

TEST(TwoMachines, with_external_synchronisation_have_their_sync0_within_50_ns_rms) {
  const TwoMachinesRun run = run_two_machines(world(), MachineMode::kExternal, 1);
  ASSERT_TRUE(run.up);
  EXPECT_LT(run.sync0_rms_ns, 50.0);
  EXPECT_LT(run.sync0_worst_ns, 200.0);
  EXPECT_LT(run.told_rms_ns, 50.0);
  EXPECT_EQ(run.faults, 0U);
}

TEST(TwoMachines, with_bus_shift_have_their_sync0_within_100_ns_rms) {
  const TwoMachinesRun run = run_two_machines(world(), MachineMode::kLead, 1);
  ASSERT_TRUE(run.up);
  EXPECT_LT(run.sync0_rms_ns, 100.0);
  EXPECT_LT(run.sync0_worst_ns, 500.0);
  EXPECT_EQ(run.faults, 0U);
}

TEST(TwoMachines, draw_a_circle_as_one_does) {
  const TwoMachinesRun one = run_two_machines(world(), MachineMode::kOne, 1);
  const TwoMachinesRun two = run_two_machines(world(), MachineMode::kExternal, 1);
  EXPECT_LT(one.contour_rms_um, 1.0);
  EXPECT_LT(two.contour_rms_um, 1.1 * one.contour_rms_um);
}

/// Stamps of 8 ns on a quiet path are the same again and again and then jump by a tick: nothing
/// that a receiver may take for a jump of the clock. Crystals up to 200 ppm off, a minute of each.
TEST(TwoMachines, have_receivers_that_keep_their_lock_with_stamps_of_8_ns) {
  TwoMachinesWorld coarse = world();
  coarse.crystal_ppm = 200.0;
  for (std::uint64_t seed = 451; seed <= 480; ++seed) {
    PlantMachine machine(coarse, node::BusMode::kExternal, true, seed, seed / 2 % 2);
    for (int sixteenth = 0; sixteenth < 60 * 16; ++sixteenth) {
      const sim::TrueTime now{Duration::from_ns(62.5e6 * sixteenth)};
      machine.receiver().advance(now);
      const auto shown = machine.host().shown_at(relabel<ethercat::WireTime>(now));
      const bool locked = machine.receiver().at(shown).has_value();
      EXPECT_TRUE(locked || sixteenth < 2 * 16) << seed << " at " << now.since_epoch().seconds();
    }
  }
}

TEST(TwoMachines, are_the_same_for_the_same_seed) {
  TwoMachinesWorld brief = world();
  brief.settling_s = 6.0;
  brief.measured_s = 1.0;
  const TwoMachinesRun a = run_two_machines(brief, MachineMode::kExternal, 3);
  const TwoMachinesRun b = run_two_machines(brief, MachineMode::kExternal, 3);
  EXPECT_EQ(a.sync0_rms_ns, b.sync0_rms_ns);
  EXPECT_EQ(a.contour_rms_um, b.contour_rms_um);
}

}  // namespace
}  // namespace ftcs::experiment
