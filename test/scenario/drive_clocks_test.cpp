// SPDX-License-Identifier: MIT
// The world: cycle_of_drives.h; SYNC0 of drive 3 shifted, SYNC1 at drive 5, a crystal that changes.
// Oracle: the drives' own registers and crystals.
#include "test/scenario/cycle_of_drives.h"

namespace ftcs::ethercat {
namespace {

using Kind = node::CycleNote::Kind;

class DriveClocks : public test::CycleOfDrives {
 protected:
  DriveClocks() {
    config_.drive_sync[3].sync0_shift = Nanoseconds{100'000};
    config_.drive_sync[4].sync0_shift = Nanoseconds{-50'000};
    config_.drive_sync[5].sync1_cycles = 2;
    config_.drive_sync[5].sync1_shift = Nanoseconds{250'000};
    config_.difference_limit = Nanoseconds{1'000};
  }
  [[nodiscard]] std::int64_t next_sync0(std::size_t n) {
    return static_cast<std::int64_t>(
        segment()[n].memory().get<std::uint64_t>(reg::kSync0StartTime));
  }
  [[nodiscard]] std::int64_t next_sync1(std::size_t n) {
    return static_cast<std::int64_t>(
        segment()[n].memory().get<std::uint64_t>(reg::kSync1StartTime));
  }
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) cycle();
  }
};

TEST_P(DriveClocks, sync0_comes_so_much_later_at_one_drive_and_sync1_behind_it_at_another) {
  to_op();
  const auto phase = [this](std::size_t n) { return next_sync0(n) % test::kCycle.count(); };
  EXPECT_EQ(phase(3) - phase(2), 100'000);
  EXPECT_EQ(phase(4) - phase(2), -50'000);
  EXPECT_EQ(phase(5), phase(2));
  EXPECT_EQ((next_sync1(5) - next_sync0(5) + test::kCycle.count()) % test::kCycle.count(), 250'000);
  EXPECT_EQ(next_sync1(2), 0) << "none";
  const std::int64_t before = next_sync1(5);
  run(2);
  EXPECT_EQ(next_sync1(5) - before, 2 * test::kCycle.count()) << "every second cycle";
  expect_all_in_op();
}

TEST_P(DriveClocks, the_difference_of_each_drive_is_told_and_who_is_beyond_the_limit) {
  to_op();
  run(2'000);
  for (std::size_t n = 0; n < 8; ++n) {
    EXPECT_GT(node().clocks()[n].readings, 50U) << n;
    EXPECT_LT(node().clocks()[n].largest, 200U) << n;
    EXPECT_EQ(node().clocks()[n].beyond, 0U) << n;
  }
  // Its own controller has to learn the new rate.
  crystal(6).set_rate(Rate::from_ppm(-60.0), now());
  run(100);
  EXPECT_GT(node().clocks()[6].last, 1'000U);
  EXPECT_EQ(node().clocks().worst(8), 6U);
  EXPECT_GT(node().clocks()[6].beyond, 0U);
  EXPECT_EQ(noted(Kind::kDriveClockOff), 1U);
  run(5'000);
  EXPECT_EQ(noted(Kind::kDriveClockBack), 1U);
  EXPECT_LT(node().clocks()[6].last, 200U);
  EXPECT_EQ(node().clocks()[5].beyond, 0U) << "the others are not touched";
}

INSTANTIATE_TEST_SUITE_P(Adaptive, DriveClocks, ::testing::Values(CycleLaw::kAdaptive));

}  // namespace
}  // namespace ftcs::ethercat
