// SPDX-License-Identifier: MIT
// The world of cycle_of_drives.h and what goes wrong in it. Never a false lock (the fixture looks
// at the truth in each cycle), and exactly those faults of the drives that real ones would raise:
// docs/ethercat.md lists them with the reason.
#include "test/scenario/cycle_of_drives.h"

namespace ftcs::ethercat {
namespace {

using test::CycleOfDrives;
using enum AlStatusCode;

constexpr Nanoseconds kStall{5'000'000};
constexpr int kSecond = 1000;  // cycles

/// With the limit of `ftcs ethercat run`: six windows missed in a row are a fault.
class Tolerant : public CycleOfDrives {
 protected:
  Tolerant() { config_.sync_error_limit = 17; }
};
INSTANTIATE_TEST_SUITE_P(Laws, Tolerant,
                         ::testing::Values(CycleLaw::kFtcs, CycleLaw::kPics, CycleLaw::kAdaptive));
/// With the limit that the drive has of itself: two windows in a row are a fault.
class Strict : public CycleOfDrives {};
INSTANTIATE_TEST_SUITE_P(Laws, Strict,
                         ::testing::Values(CycleLaw::kFtcs, CycleLaw::kPics, CycleLaw::kAdaptive));

TEST_P(Tolerant, five_percent_of_the_frames_lost_fault_nobody) {
  to_op();
  std::uint64_t random = 7;
  int lost = 0;
  for (int i = 0; i < 10 * kSecond; ++i) {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    const bool drop = static_cast<double>(random >> 11) / 9007199254740992.0 < 0.05;
    lost += drop ? 1 : 0;
    cycle(drop);
  }
  EXPECT_NEAR(lost, 500, 80);
  EXPECT_EQ(lock_losses(), 0U);
  expect_all_in_op();
  for (std::size_t n = 0; n < 8; ++n) expect_faults(n, {});
}

TEST_P(Tolerant, a_stall_of_5_ms_each_second_is_ridden_through) {
  to_op();
  for (int second = 0; second < 10; ++second) {
    cycle(false, kStall);
    for (int i = 1; i < kSecond; ++i) cycle();
  }
  EXPECT_EQ(lock_losses(), 0U);
  expect_all_in_op();
  for (std::size_t n = 0; n < 8; ++n) {
    expect_faults(n, {});
    EXPECT_EQ(segment()[n].drive().statistics().missed, 50U) << "five windows each time";
  }
}

TEST_P(Strict, a_stall_of_5_ms_each_second_is_a_synchronisation_error_each_time) {
  to_op();
  constexpr std::uint32_t kStalls = 5;
  for (std::uint32_t second = 0; second < kStalls; ++second) {
    cycle(false, kStall);
    for (int i = 1; i < kSecond; ++i) cycle();
  }
  EXPECT_EQ(lock_losses(), 0U) << "the servo knows that it was late";
  expect_all_in_op();
  for (std::size_t n = 0; n < 8; ++n) expect_faults(n, {{kSynchronizationError, kStalls}});
}

TEST_P(Tolerant, a_restarted_drive_comes_back_and_disturbs_nobody) {
  to_op();
  segment().power_cycle(3, now());
  for (int i = 0; i < 5 * kSecond; ++i) cycle();
  EXPECT_EQ(main().counters().reintegrated, 1U);
  EXPECT_EQ(lock_losses(), 0U);
  expect_all_in_op();
  // The supply was gone and with it whatever it might have said.
  for (std::size_t n = 0; n < 8; ++n) expect_faults(n, {});
}

TEST_P(Tolerant, the_reference_restarted_gets_its_time_back_and_the_lock_with_it) {
  to_op();
  truth_ = 1;  // the one that carries the time on
  segment().power_cycle(0, now());
  for (int i = 0; i < 8 * kSecond; ++i) cycle();
  EXPECT_EQ(main().counters().reintegrated, 1U);
  EXPECT_EQ(state(), CycleState::kLocked);
  expect_all_in_op();
  for (std::size_t n = 0; n < 8; ++n) expect_faults(n, {});
}

TEST_P(Tolerant, a_cut_wire_faults_those_behind_it_and_the_rest_is_stopped) {
  to_op();
  segment().set_cut(5, true);
  for (int i = 0; i < 100 && main().cyclic(); ++i) cycle();
  EXPECT_EQ(main().failure().kind, FailureKind::kWorkingCounter);
  let_stop();
  host_->wait(Duration{Nanoseconds{20'000'000}});
  segment().advance(now());
  for (std::size_t n = 0; n < 5; ++n) {
    EXPECT_EQ(segment()[n].drive().state(), AlState::kSafeOp);
    expect_faults(n, {});
  }
  for (std::size_t n = 5; n < 8; ++n) expect_faults(n, {{kSynchronizationError, 1}});
}

TEST_P(Tolerant, a_step_of_the_reference_by_100_ppm_is_followed_within_three_intervals) {
  to_op();
  crystal(0).set_rate(Rate::from_ppm(150.0), now());
  for (std::uint32_t i = 0; i < 3 * kCyclesPerSync; ++i) cycle();
  EXPECT_EQ(state(), CycleState::kLocked);
  EXPECT_LT(std::abs(true_error()), 5000.0);
  EXPECT_LE(lock_losses(), 1U);
  EXPECT_LE(relock(), static_cast<int>(2 * kCyclesPerSync + 40));
  for (int i = 0; i < 10 * kSecond; ++i) cycle();
  EXPECT_LT(std::abs(true_error()), 1000.0);
  expect_all_in_op();
  // 100 ppm are no jump of phase: the other clocks follow faster than their drives' own loops mind.
  for (std::size_t n = 0; n < 8; ++n) expect_faults(n, {});
}

}  // namespace
}  // namespace ftcs::ethercat
