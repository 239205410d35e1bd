// SPDX-License-Identifier: MIT
// The world of cycle_of_drives.h: the rules that ask drives for OP and that stop them.
#include "test/scenario/cycle_of_drives.h"

namespace ftcs::ethercat {
namespace {

using node::CycleNote;
using node::LockPolicy;
using test::CycleOfDrives;

constexpr int kSecond = 1000;  // cycles

class Supervision : public CycleOfDrives {
 protected:
  Supervision() {
    config_.sync_error_limit = 0;  // the drives themselves shall not be the ones who end it
    config_.supervision.unlocked_limit = 3 * kSecond;
    // Losing frames is not what is tried here.
    config_.main.lost_frame_limit = 1'000'000;
  }
  /// The reference runs away faster than the servo is allowed to follow.
  void lose_the_lock() {
    check_truth_ = false;  // five stamps in a row that disagree are doubted first
    crystal(0).set_rate(Rate::from_ratio(1.02), now());
    for (int i = 0; i < kSecond && state() == CycleState::kLocked; ++i) cycle();
    ASSERT_NE(state(), CycleState::kLocked);
    ASSERT_EQ(noted(CycleNote::Kind::kLockLost), 1U);
  }
};
INSTANTIATE_TEST_SUITE_P(Laws, Supervision, ::testing::Values(CycleLaw::kFtcs));

TEST_P(Supervision, op_is_not_asked_for_before_the_lock) {
  int cycles = 0;
  for (; state() != CycleState::kLocked && cycles < kSecond; ++cycles) {
    ASSERT_EQ(noted(CycleNote::Kind::kOpRequested), 0U);
    cycle();
  }
  EXPECT_EQ(node().supervision().lock_cycle(), cycles);
  EXPECT_EQ(noted(CycleNote::Kind::kOpRequested), 1U);
  for (int i = 0; i < 100; ++i) cycle();
  expect_all_in_op();
  EXPECT_GT(node().supervision().op_cycle(), node().supervision().lock_cycle());
}

TEST_P(Supervision, a_lock_that_does_not_come_back_stops_the_drives_after_its_limit) {
  to_op();
  lose_the_lock();
  int without = 1;
  for (; node().cyclic() && without < 20 * kSecond; ++without) cycle();
  EXPECT_EQ(without, 3 * kSecond);
  EXPECT_EQ(main().failure().kind, FailureKind::kSyncLost);
  let_stop();
  for (std::size_t n = 0; n < 8; ++n) EXPECT_EQ(segment()[n].drive().state(), AlState::kSafeOp);
}

TEST_P(Supervision, a_lock_that_comes_back_in_time_lets_the_drives_go_on) {
  to_op();
  lose_the_lock();
  for (int i = 0; i < kSecond; ++i) cycle();
  crystal(0).set_rate(Rate::from_ppm(50.0), now());
  for (int i = 0; i < 6 * kSecond; ++i) cycle();
  EXPECT_EQ(state(), CycleState::kLocked);
  EXPECT_LT(std::abs(true_error()), 5000.0);
  EXPECT_TRUE(node().cyclic());
}

class Advisory : public Supervision {
 protected:
  Advisory() { config_.supervision.lock_policy = LockPolicy::kAdvisory; }
};
INSTANTIATE_TEST_SUITE_P(Laws, Advisory, ::testing::Values(CycleLaw::kFtcs));

TEST_P(Advisory, a_lost_lock_is_told_and_stops_nobody) {
  to_op();
  lose_the_lock();
  for (int i = 0; i < 10 * kSecond; ++i) cycle();
  EXPECT_TRUE(node().cyclic());
}

class Fatal : public Supervision {
 protected:
  Fatal() { config_.supervision.lock_policy = LockPolicy::kFatal; }
};
INSTANTIATE_TEST_SUITE_P(Laws, Fatal, ::testing::Values(CycleLaw::kFtcs));

TEST_P(Fatal, a_lost_lock_stops_the_drives_in_the_same_cycle) {
  to_op();
  lose_the_lock();
  EXPECT_FALSE(node().cyclic());
  EXPECT_EQ(main().failure().kind, FailureKind::kSyncLost);
}

class Impatient : public Supervision {
 protected:
  Impatient() { config_.supervision.await_limit = kCyclesPerSync / 2; }
};
INSTANTIATE_TEST_SUITE_P(Laws, Impatient, ::testing::Values(CycleLaw::kFtcs));

TEST_P(Impatient, a_first_lock_that_is_waited_for_in_vain_ends_with_its_reason) {
  int cycles = 0;
  for (; node().cyclic() && cycles < kSecond; ++cycles) cycle();
  EXPECT_EQ(cycles, static_cast<int>(kCyclesPerSync / 2));
  EXPECT_EQ(main().failure().kind, FailureKind::kNeverLocked);
  EXPECT_EQ(noted(CycleNote::Kind::kOpRequested), 0U);
}

/// Axes that move, and a drive that faults for ever.
class Axes : public Supervision {
 protected:
  Axes() { config_.axes.move = true; }
  void fault_for_ever(int cycles) {
    to_op();
    for (int i = 0; i < cycles; ++i) {
      segment()[3].drive().motor().fault(0x8700);
      cycle();
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Laws, Axes, ::testing::Values(CycleLaw::kFtcs));

TEST_P(Axes, a_fault_is_not_reset_unless_asked_for) {
  fault_for_ever(kSecond);
  EXPECT_EQ(noted(CycleNote::Kind::kAxisFault), 1U);
  EXPECT_EQ(noted(CycleNote::Kind::kFaultReset), 0U);
}

class Resetting : public Axes {
 protected:
  Resetting() { config_.axes.fault_resets = 3; }
};
INSTANTIATE_TEST_SUITE_P(Laws, Resetting, ::testing::Values(CycleLaw::kFtcs));

TEST_P(Resetting, a_fault_is_reset_as_often_as_asked_for_and_not_more) {
  fault_for_ever(kSecond);
  EXPECT_EQ(noted(CycleNote::Kind::kFaultReset), 3U);
  for (int i = 0; i < kSecond; ++i) cycle();
  EXPECT_EQ(noted(CycleNote::Kind::kFaultReset), 3U) << "a number for the whole run";
}

TEST_P(Resetting, a_fault_that_goes_away_is_enabled_again) {
  to_op();
  for (int i = 0; i < 2 * kSecond; ++i) cycle();
  ASSERT_EQ(node().axes()[3].state(), AxisState::kEnabled);
  segment()[3].drive().motor().fault(0x8700);
  for (int i = 0; i < 3 * kSecond; ++i) cycle();
  EXPECT_EQ(noted(CycleNote::Kind::kFaultReset), 1U);
  EXPECT_EQ(node().axes()[3].state(), AxisState::kEnabled);
}

}  // namespace
}  // namespace ftcs::ethercat
