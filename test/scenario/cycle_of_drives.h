// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/ethercat/test/main_bench.h"

namespace ftcs::ethercat::test {

inline constexpr Nanoseconds kCycle{1'000'000};

/// A MainDevice whose host wakes 20 to 120 us late, eight drives (reference +50 ppm, the others ±80
/// ppm, 10 ns ticks), the cycle servo between them; everything in simulated time, cycle 1 ms.
/// Truth: the drives' own SYNC0 and the reference's system time.
class CycleOfDrives : public ::testing::TestWithParam<CycleLaw> {
 protected:
  void SetUp() override {
    const auto objects = csp_objects(kCycle);
    objects_.assign(objects.begin(), objects.end());
    if (sync_error_limit_ > 0) objects_.push_back({{0x10F1, 2}, 2, sync_error_limit_});
    MainDeviceConfig config;
    config.process.objects = objects_;
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
    servo.cycles_per_sync = kCyclesPerSync;
    servo_ = std::make_unique<CycleServo>(servo);
    decision_ = servo_->start(host());
  }
  [[nodiscard]] FreeRunningTime host() const { return FreeRunningTime{bench_.now().since_epoch()}; }
  void cycle(bool lost = false, Duration stall = {}) {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const Duration late = Duration::from_ns(20'000.0 + static_cast<double>(state_ >> 48));
    bench_.wait(Nanoseconds{(decision_.wake + late + stall - host()).floor_ns()});
    bench_.lose = [lost](std::size_t) { return lost; };
    if (decision_.state != CycleState::kWaiting) {
      bench_.main().set_reference_estimate(ReferenceTime{servo_->local_at(host()).since_epoch()});
    }
    CycleSample sample;
    sample.sent = host();
    const bool answered = bench_.exchange_once();
    sample.has_reference = answered && bench_.main().last_cycle().has_reference;
    sample.reference = bench_.main().last_cycle().reference;
    bench_.wait(Nanoseconds{60'000});
    decision_ = servo_->update(sample, host());
    note_lock();
    // Whoever says it is locked must be near the grid of the reference.
    if (decision_.state == CycleState::kLocked) {
      EXPECT_LT(std::abs(true_error()), 25'000.0) << "false lock";
    }
  }
  void note_lock() {
    ++cycles_;
    const bool locked = decision_.state == CycleState::kLocked;
    if (was_locked_ && !locked) lost_at_ = cycles_;
    if (was_locked_ && !locked) ++lock_losses_;
    if (!was_locked_ && locked && lost_at_ > 0) relock_ = cycles_ - lost_at_;
    was_locked_ = locked;
  }
  [[nodiscard]] double true_error() {
    const WireTime trigger{decision_.virtual_instant.since_epoch()};
    const auto at = static_cast<std::int64_t>(bench_.segment()[truth_].dc().system_time(trigger));
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

  /// Exactly these codes, so often, were raised by drive n.
  void expect_faults(std::size_t n, std::vector<std::pair<AlStatusCode, std::uint32_t>> wanted) {
    const auto faults = bench_.segment()[n].drive().faults();
    ASSERT_EQ(faults.size(), wanted.size()) << "drive " << n;
    for (std::size_t i = 0; i < faults.size(); ++i) {
      EXPECT_EQ(faults[i].code, wanted[i].first) << n << ": " << name(faults[i].code);
      EXPECT_EQ(faults[i].count, wanted[i].second) << n << ": " << name(faults[i].code);
    }
  }

  static constexpr std::uint32_t kCyclesPerSync = 200;
  std::uint32_t sync_error_limit_ = 0;  ///< 0x10F1:02; zero: the drive's own default
  std::vector<SdoDownload> objects_;
  int cycles_ = 0;
  int lost_at_ = 0;
  int lock_losses_ = 0;
  int relock_ = 0;  ///< cycles from the last loss of the lock to the next one
  bool was_locked_ = false;
  std::size_t truth_ = 0;  ///< the drive whose clock is asked
  MainBench bench_;
  std::unique_ptr<CycleServo> servo_;
  CycleDecision decision_;
  std::uint64_t state_ = 5;
};

}  // namespace ftcs::ethercat::test
