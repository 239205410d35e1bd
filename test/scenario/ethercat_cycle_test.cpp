// SPDX-License-Identifier: MIT
// The world: a MainDevice whose host wakes 20 to 120 us late, eight drives (reference +50 ppm, the
// others ±80 ppm, 10 ns ticks), the cycle servo between them; everything in simulated time, cycle 1
// ms. Truth: the drives' own SYNC0 and the reference's system time.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/ethercat/test/main_bench.h"

namespace ftcs::ethercat {
namespace {

constexpr Nanoseconds kCycle{1'000'000};
constexpr auto kObjects = csp_objects(kCycle);

class CycleOfDrives : public ::testing::TestWithParam<CycleLaw> {
 protected:
  void SetUp() override {
    MainDeviceConfig config;
    config.process.objects = kObjects;
    config.process.cycle = kCycle;
    config.process.sync0_shift = Nanoseconds{500'000};
    bench_.configure(config);
    for (int n = 0; n < 8; ++n) {
      const double ppm = n == 0 ? 50.0 : (n % 2 == 0 ? 80.0 : -80.0);
      bench_.add({.parent = n - 1, .cable = Nanoseconds{50}}, ppm);
    }
    bench_.bring_up();
    ASSERT_TRUE(bench_.main().cyclic());
    CycleServoConfig servo;
    servo.law = GetParam();
    servo.cycles_per_sync = 200;
    servo_ = std::make_unique<CycleServo>(servo);
    decision_ = servo_->start(host());
  }
  [[nodiscard]] FreeRunningTime host() const { return FreeRunningTime{bench_.now().since_epoch()}; }
  void cycle(bool lost = false, Duration stall = {}) {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const Duration late = Duration::from_ns(20'000.0 + static_cast<double>(state_ >> 48));
    bench_.wait(Nanoseconds{(decision_.wake + late + stall - host()).floor_ns()});
    bench_.lose = [lost](std::size_t) { return lost; };
    CycleSample sample;
    sample.sent = host();
    const bool answered = bench_.exchange_once();
    sample.has_reference = answered && bench_.main().last_cycle().has_reference;
    sample.reference = bench_.main().last_cycle().reference;
    bench_.wait(Nanoseconds{60'000});
    decision_ = servo_->update(sample, host());
    // Whoever says it is locked must be near the grid of the reference.
    if (decision_.state == CycleState::kLocked) {
      EXPECT_LT(std::abs(true_error()), 25'000.0) << "false lock";
    }
  }
  [[nodiscard]] double true_error() {
    const WireTime trigger{decision_.virtual_instant.since_epoch()};
    const auto at = static_cast<std::int64_t>(bench_.segment()[0].dc().system_time(trigger));
    return static_cast<double>((at + 500'000) % 1'000'000 - 500'000);
  }
  void to_op() {
    for (int i = 0; i < 800; ++i) cycle();
    ASSERT_EQ(decision_.state, CycleState::kLocked);
    bench_.main().request_operational();
    for (int i = 0; i < 100; ++i) cycle();
    ASSERT_TRUE(bench_.main().last_cycle().all_operational());
  }
  void expect_all_in_op() {
    for (std::size_t n = 0; n < 8; ++n) {
      EXPECT_EQ(bench_.segment()[n].drive().state(), AlState::kOp)
          << n << ": " << name(bench_.segment()[n].drive().code());
    }
  }

  test::MainBench bench_;
  std::unique_ptr<CycleServo> servo_;
  CycleDecision decision_;
  std::uint64_t state_ = 5;
};
INSTANTIATE_TEST_SUITE_P(Laws, CycleOfDrives,
                         ::testing::Values(CycleLaw::kFtcs, CycleLaw::kPics, CycleLaw::kAdaptive));

TEST_P(CycleOfDrives, stays_in_phase_and_in_op_without_a_missed_window) {
  to_op();
  for (int i = 0; i < 5000; ++i) {
    cycle();
    ASSERT_LT(std::abs(true_error()), 1000.0);
  }
  expect_all_in_op();
  EXPECT_EQ(bench_.main().counters().wrong_working_counter, 0U);
  for (std::size_t n = 0; n < 8; ++n) {
    EXPECT_EQ(bench_.segment()[n].drive().statistics().missed, 0U);
    EXPECT_LT(std::abs(bench_.segment()[n].system_time_difference()), 100);
  }
}

TEST_P(CycleOfDrives, single_lost_frames_are_coasted_and_fault_nobody) {
  to_op();
  for (int i = 0; i < 3000; ++i) cycle(i % 20 == 7);  // 5 %, never two in a row
  EXPECT_EQ(decision_.state, CycleState::kLocked);
  expect_all_in_op();
}

TEST_P(CycleOfDrives, a_stall_of_five_cycles_faults_the_drives_and_not_the_lock) {
  to_op();
  cycle(false, Nanoseconds{5'000'000});
  for (int i = 0; i < 20; ++i) cycle();
  EXPECT_EQ(decision_.state, CycleState::kLocked);
  for (std::size_t n = 0; n < 8; ++n) {
    // Windows without outputs: what a real drive says.
    EXPECT_EQ(bench_.segment()[n].drive().code(), AlStatusCode::kSynchronizationError);
  }
}

TEST_P(CycleOfDrives, a_step_of_the_reference_by_100_ppm_is_followed) {
  to_op();
  bench_.crystal(0).set_rate(Rate::from_ppm(150.0), bench_.now());
  // Inside B = 20 us FTCS takes off a sixteenth of the phase per interval: sixty of them.
  for (int i = 0; i < 12000; ++i) cycle();
  EXPECT_EQ(decision_.state, CycleState::kLocked);
  EXPECT_LT(std::abs(true_error()), 1000.0);
  expect_all_in_op();
}

}  // namespace
}  // namespace ftcs::ethercat
