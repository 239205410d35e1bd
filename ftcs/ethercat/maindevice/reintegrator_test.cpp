// SPDX-License-Identifier: MIT
// The world: a MainDevice and eight modelled drives with crystals of up to ±100 ppm in a line, in
// OP with a cycle of 1 ms, in simulated time. One of them loses its supply for a moment.
#include "ftcs/ethercat/maindevice/reintegrator.h"

#include <gtest/gtest.h>

#include "test/support/main_bench.h"

namespace ftcs::ethercat {
namespace {

constexpr Nanoseconds kCycle{1'000'000};

class Restart : public ::testing::Test {
 protected:
  explicit Restart(std::uint32_t absence_limit = 10) {
    const auto objects = csp_objects(kCycle);
    objects_.assign(objects.begin(), objects.end());
    MainDeviceConfig config;
    config.process.objects = objects_;
    config.process.cycle = kCycle;
    config.process.sync0_shift = Nanoseconds{500'000};
    config.absence_limit = absence_limit;
    bench_.configure(config);
    for (int i = 0; i < 8; ++i) {
      const double ppm = i == 0 ? 0.0 : (i % 2 == 0 ? 100.0 : -100.0);
      bench_.add({.parent = i - 1, .cable = Nanoseconds{50}}, ppm);
    }
  }
  void to_op() {
    bench_.bring_up();
    ASSERT_TRUE(main().cyclic()) << name(main().failure().kind);
    const auto reference = bench_.segment()[0].dc().system_time(bench_.now());
    bench_.wait(Nanoseconds{1'000'000 - static_cast<std::int64_t>(reference % 1'000'000)});
    cycles(150);
    main().request_operational();
    cycles(50);
    ASSERT_TRUE(main().last_cycle().all_operational());
  }
  /// The MainDevice believes that the reference runs like the wire, which drive 0 does.
  void cycles(int n) {
    for (int i = 0; i < n; ++i) {
      if (main().cyclic() && origin_ == 0) origin_ = truth(0) - wire();
      main().set_reference_estimate(ReferenceTime::from_ns(wire() + origin_));
      bench_.run(1);
      if (main().last_cycle().inputs_valid) ++valid_;
    }
  }
  [[nodiscard]] std::int64_t wire() const { return bench_.now().since_epoch().rounded_ns(); }
  [[nodiscard]] std::int64_t truth(std::size_t n) {
    return static_cast<std::int64_t>(bench_.segment()[n].dc().system_time(bench_.now()));
  }
  void restart(std::size_t n) { bench_.segment().power_cycle(n, bench_.now()); }
  [[nodiscard]] MainDevice& main() { return bench_.main(); }
  [[nodiscard]] const DriveApplication& drive(std::size_t n) { return bench_.segment()[n].drive(); }
  /// All but one stayed in OP and missed nothing since `before`.
  void expect_others_undisturbed(std::size_t restarted) {
    for (std::size_t n = 0; n < 8; ++n) {
      if (n == restarted) continue;
      EXPECT_EQ(drive(n).state(), AlState::kOp) << n << " " << name(drive(n).code());
      EXPECT_EQ(drive(n).statistics().missed, 0U) << n;
    }
  }

  test::MainBench bench_;
  std::vector<SdoDownload> objects_;
  std::int64_t origin_ = 0;
  std::uint64_t valid_ = 0;
};

TEST_F(Restart, a_restarted_drive_comes_back_to_op_while_the_others_run) {
  to_op();
  restart(3);
  valid_ = 0;
  cycles(5);
  EXPECT_EQ(main().last_cycle().expected, 21) << "known to be out within a few cycles";
  EXPECT_TRUE(main().last_cycle().inputs_valid);
  EXPECT_EQ(main().reintegrating(), 3U);
  cycles(5000);
  EXPECT_TRUE(main().cyclic()) << name(main().failure().kind);
  EXPECT_EQ(main().counters().reintegrated, 1U);
  EXPECT_TRUE(main().complete());
  EXPECT_TRUE(main().last_cycle().all_operational()) << std::hex << main().last_cycle().states;
  EXPECT_EQ(main().last_cycle().working_counter, 24);
  EXPECT_GE(valid_, 5000U) << "few cycles without valid inputs";
  expect_others_undisturbed(3);
  // Its clock and its SYNC0 are the others'.
  EXPECT_LT(std::abs(bench_.segment()[3].system_time_difference()), 100);
  EXPECT_LT(std::abs(truth(3) - truth(2)), 200);
  EXPECT_NEAR(static_cast<double>(drive(3).statistics().last_margin_ns), 500'000 - 50 - 350.0 * 3,
              300.0);
}

TEST_F(Restart, lost_frames_do_not_stop_it) {
  to_op();
  restart(7);
  bench_.lose = [n = 0](std::size_t) mutable { return ++n % 20 == 0; };
  cycles(6000);
  EXPECT_EQ(main().counters().reintegrated, 1U);
  EXPECT_EQ(drive(7).state(), AlState::kOp);
}

TEST_F(Restart, two_at_once_come_back_one_after_another) {
  to_op();
  restart(2);
  restart(5);
  cycles(8000);
  EXPECT_EQ(main().counters().reintegrated, 2U);
  EXPECT_TRUE(main().last_cycle().all_operational());
}

TEST_F(Restart, the_reference_gets_its_time_back_from_a_clock_that_followed_it) {
  to_op();
  const std::int64_t before = truth(0) - wire();
  restart(0);
  cycles(1);
  EXPECT_FALSE(main().last_cycle().has_reference) << "what was sent is no answer";
  cycles(4000);
  EXPECT_EQ(main().counters().reintegrated, 1U);
  EXPECT_TRUE(main().last_cycle().all_operational());
  EXPECT_TRUE(main().last_cycle().has_reference);
  expect_others_undisturbed(0);
  // Nobody corrected the others in the meantime, and the source is one of them.
  EXPECT_LT(std::abs(truth(0) - wire() - before), 20'000);
}

TEST_F(Restart, a_drive_that_cannot_be_configured_again_stops_the_others_in_good_order) {
  to_op();
  objects_[0].object = {0x2000, 1};
  objects_[0].required = true;
  restart(3);
  cycles(9000);
  EXPECT_EQ(main().stage(), Stage::kStopped);
  EXPECT_EQ(main().failure().kind, FailureKind::kSdoAborted);
  EXPECT_EQ(main().failure().position, 3);
  EXPECT_EQ(drive(1).state(), AlState::kSafeOp);
  EXPECT_EQ(drive(1).code(), AlStatusCode::kNoError);
}

TEST_F(Restart, another_drive_in_its_place_is_not_configured_and_the_others_are_stopped) {
  to_op();
  SubDeviceConfig other;
  other.identity.product += 1;
  bench_.segment().replace(3, other, bench_.crystal(3), bench_.now());
  cycles(9000);
  EXPECT_EQ(main().stage(), Stage::kStopped);
  EXPECT_EQ(main().failure().kind, FailureKind::kReplaced);
  EXPECT_EQ(main().failure().position, 3);
  EXPECT_EQ(main().failure().known, main().network().devices[3].sii.identity);
  EXPECT_EQ(main().failure().found, other.identity);
  EXPECT_EQ(drive(3).state(), AlState::kInit) << "it was told nothing";
  EXPECT_EQ(drive(1).state(), AlState::kSafeOp);
  EXPECT_EQ(drive(1).code(), AlStatusCode::kNoError);
}

TEST_F(Restart, the_same_type_with_another_serial_number_is_another_drive) {
  to_op();
  SubDeviceConfig other;
  other.identity.serial = 4711;
  bench_.segment().replace(7, other, bench_.crystal(7), bench_.now());
  cycles(9000);
  EXPECT_EQ(main().failure().kind, FailureKind::kReplaced);
  EXPECT_EQ(main().failure().found.serial, 4711U);
}

class CutAndMended : public Restart {
 protected:
  CutAndMended() : Restart(1'000'000) {}
};

TEST_F(CutAndMended, the_part_that_was_out_of_reach_is_acknowledged_and_comes_back) {
  to_op();
  bench_.segment().set_cut(5, true);
  cycles(500);
  ASSERT_TRUE(main().cyclic());
  EXPECT_EQ(main().last_cycle().expected, 15);
  EXPECT_TRUE(main().last_cycle().inputs_valid);
  bench_.segment().set_cut(5, false);
  cycles(100);
  for (std::size_t n = 5; n < 8; ++n) {
    // Windows without outputs, and nothing else: the clocks ran on.
    EXPECT_EQ(drive(n).code(), AlStatusCode::kSynchronizationError) << n;
    EXPECT_TRUE(main().takes_part(n));
  }
  for (int round = 0; round < 20; ++round) {
    for (std::size_t n = 5; n < 8; ++n) main().recover(n);
    cycles(50);
  }
  EXPECT_TRUE(main().last_cycle().all_operational());
  EXPECT_EQ(main().counters().reintegrated, 0U) << "nobody had lost anything";
  for (std::size_t n = 0; n < 5; ++n) EXPECT_EQ(drive(n).statistics().missed, 0U);
}

}  // namespace
}  // namespace ftcs::ethercat
