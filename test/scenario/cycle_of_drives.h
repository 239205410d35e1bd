// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <deque>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/sim/cycle_host.h"
#include "ftcs/time/relabel.h"

namespace ftcs::ethercat::test {

inline constexpr Nanoseconds kCycle{1'000'000};

/// The node that ships on a host that wakes 20 to 120 us late, eight drives (reference +50 ppm, the
/// others ±80 ppm, 10 ns ticks); everything in simulated time, cycle 1 ms.
/// Truth: the drives' own SYNC0 and the reference's system time.
class CycleOfDrives : public ::testing::TestWithParam<CycleLaw> {
 protected:
  CycleOfDrives() {
    config_.servo.cycle = kCycle;
    config_.servo.cycles_per_sync = kCyclesPerSync;
    config_.axes.move = false;
  }
  void SetUp() override {
    config_.servo.law = GetParam();
    segment_ = std::make_unique<Segment>();
    for (int n = 0; n < 8; ++n) {
      const double ppm = n == 0 ? 50.0 : (n % 2 == 0 ? 80.0 : -80.0);
      crystals_.emplace_back(Rate::from_ppm(ppm));
      ASSERT_TRUE(segment_->add({}, {.parent = n - 1, .cable = Nanoseconds{50}}, crystals_.back()));
    }
    host_ = std::make_unique<sim::CycleHost>(config_, *segment_, WireTime::from_ns(1'000'000));
    ASSERT_TRUE(host_->bring_up());
  }
  [[nodiscard]] node::CycleNode& node() { return host_->node(); }
  [[nodiscard]] const MainDevice& main() { return node().main(); }
  [[nodiscard]] Segment& segment() { return *segment_; }
  [[nodiscard]] AffineOscillator& crystal(std::size_t n) { return crystals_[n]; }
  [[nodiscard]] WireTime now() const { return host_->now(); }
  [[nodiscard]] CycleState state() { return node().decision().state; }
  [[nodiscard]] std::uint64_t lock_losses() { return node().supervision().lock().losses(); }
  /// Most cycles from the loss of a lock to the next one.
  [[nodiscard]] int relock() {
    return static_cast<int>(node().supervision().lock().longest_relock());
  }

  void cycle(bool lost = false, Duration stall = {}) {
    random_ = random_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const Duration late = Duration::from_ns(20'000.0 + static_cast<double>(random_ >> 48));
    host_->cycle(late + stall, lost);
    for (const node::CycleNote& note : node().notes()) notes_.push_back(note);
    // Whoever says it is locked must be near the grid of the reference.
    if (check_truth_ && state() == CycleState::kLocked) {
      EXPECT_LT(std::abs(true_error()), 25'000.0) << "false lock";
    }
  }
  [[nodiscard]] double true_error() {
    const auto trigger = relabel<WireTime>(node().decision().virtual_instant);
    const auto at = static_cast<std::int64_t>(segment()[truth_].dc().system_time(trigger));
    return static_cast<double>((at + 500'000) % 1'000'000 - 500'000);
  }
  /// The node asks for OP by itself, when it is locked.
  void to_op() {
    for (int i = 0; i < 800; ++i) cycle();
    ASSERT_EQ(state(), CycleState::kLocked);
    for (int i = 0; i < 100; ++i) cycle();
    ASSERT_TRUE(main().last_cycle().all_operational());
  }
  void expect_all_in_op() {
    for (std::size_t n = 0; n < 8; ++n) {
      EXPECT_EQ(segment()[n].drive().state(), AlState::kOp)
          << n << ": " << name(segment()[n].drive().code());
    }
  }
  /// Exactly these codes, so often, were raised by drive n.
  void expect_faults(std::size_t n, std::vector<std::pair<AlStatusCode, std::uint32_t>> wanted) {
    const auto faults = segment()[n].drive().faults();
    ASSERT_EQ(faults.size(), wanted.size()) << "drive " << n;
    for (std::size_t i = 0; i < faults.size(); ++i) {
      EXPECT_EQ(faults[i].code, wanted[i].first) << n << ": " << name(faults[i].code);
      EXPECT_EQ(faults[i].count, wanted[i].second) << n << ": " << name(faults[i].code);
    }
  }
  [[nodiscard]] std::size_t noted(node::CycleNote::Kind kind) const {
    std::size_t count = 0;
    for (const node::CycleNote& note : notes_) count += note.kind == kind ? 1 : 0;
    return count;
  }
  /// The way to SAFEOP, once something stopped the drives.
  void let_stop() {
    for (int i = 0; i < 1000 && !node().stopped(); ++i) {
      host_->exchange();
      host_->wait(Duration{kCycle});
    }
    ASSERT_TRUE(node().stopped());
  }

  static constexpr std::uint32_t kCyclesPerSync = 200;
  node::CycleNodeConfig config_;  ///< changed by a test's constructor
  std::vector<node::CycleNote> notes_;
  std::size_t truth_ = 0;  ///< the drive whose clock is asked
  bool check_truth_ = true;
  std::unique_ptr<Segment> segment_;
  std::deque<AffineOscillator> crystals_;
  std::unique_ptr<sim::CycleHost> host_;
  std::uint64_t random_ = 5;
};

}  // namespace ftcs::ethercat::test
