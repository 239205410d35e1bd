// SPDX-License-Identifier: MIT
// The world: four modelled drives and a bridge terminal on a host that wakes 20 to 120 us late, all
// crystals within 50 ppm; the other side of the terminal is the clock of another segment, which is
// plant time. Everything in simulated time, cycle 1 ms. Truth: the clocks of the models.
#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/sim/cycle_host.h"
#include "ftcs/sim/random.h"
#include "ftcs/time/relabel.h"

namespace ftcs::node {
namespace {

using ethercat::FailureKind;
using ethercat::WireTime;

constexpr std::int64_t kSomeDayNs = 850'000'000'000'000'000;  // 2026, on the epoch of 2000
constexpr int kSecond = 1000;                                 // cycles

/// Another segment: its reference clock, of 10 ns ticks, some ppm off.
class PlantSegment final : public ethercat::OtherSide {
 public:
  explicit PlantSegment(double ppm) : crystal_(Rate::from_ppm(ppm)) {}
  [[nodiscard]] std::optional<std::uint64_t> system_time(WireTime instant) noexcept override {
    if (!connected_) return std::nullopt;
    const std::int64_t shown = kSomeDayNs + step_ns_ + crystal_.reading(instant).floor_ns();
    return static_cast<std::uint64_t>(shown - shown % 10);
  }
  void connect(bool connected) { connected_ = connected; }
  void step(std::int64_t by_ns) { step_ns_ += by_ns; }
  [[nodiscard]] double exact_ns(WireTime instant) {
    return static_cast<double>(step_ns_) + crystal_.reading(instant).ns();
  }

 private:
  ethercat::AffineOscillator crystal_;
  bool connected_ = true;
  std::int64_t step_ns_ = 0;
};

class WithABridge : public ::testing::Test {
 protected:
  static constexpr std::size_t kDrives = 4;

  void build(std::size_t bridge_position, std::uint64_t seed) {
    draw_.emplace(seed, "bridge");
    plant_ = std::make_unique<PlantSegment>(ppm());
    segment_ = std::make_unique<ethercat::Segment>();
    for (std::size_t n = 0; n <= kDrives; ++n) {
      crystals_.emplace_back(Rate::from_ppm(ppm()));
      ethercat::SubDeviceConfig config;
      if (n == bridge_position) {
        config.identity = ethercat::kBridgeIdentity;
        config.other_side = plant_.get();
      }
      const int parent = static_cast<int>(n) - 1;
      ASSERT_TRUE(
          segment_->add(config, {.parent = parent, .cable = Nanoseconds{50}}, crystals_.back()));
    }
    config_.servo.law = CycleLaw::kAdaptive;
    config_.main.clocks.drift_pulses = 3000;
    config_.main.process.bridge = ethercat::bridge::kFirst;
    config_.axes.turn_s = 1.0;
  }
  void power_on(double phase_s = 1.0) {
    host_ = std::make_unique<sim::CycleHost>(config_, *segment_,
                                             WireTime{Duration::from_ns(phase_s * 1e9)});
    host_->set_stamp_noise([this] { return Duration::from_ns(300.0 * draw_->normal()); });
  }
  void cycles(int count) {
    for (int i = 0; i < count; ++i) {
      host_->cycle(Duration::from_ns(20'000.0 + 100'000.0 * draw_->uniform()));
    }
  }
  [[nodiscard]] double ppm() { return 100.0 * draw_->uniform() - 50.0; }
  [[nodiscard]] const CycleNode& node() const { return host_->node(); }
  /// System time of a drive less plant time, in the middle between two frames, when SYNC0 is.
  [[nodiscard]] double error_ns(std::size_t position) {
    const WireTime instant = host_->instant_of(node().decision().wake) + Duration::from_ns(0.5e6);
    const auto shown = static_cast<std::int64_t>((*segment_)[position].dc().system_time(instant));
    return static_cast<double>(shown - kSomeDayNs) - plant_->exact_ns(instant);
  }
  void expect_unharmed() {
    for (std::size_t n = 0; n < segment_->size(); ++n) {
      const auto& drive = (*segment_)[n].drive();
      EXPECT_EQ(drive.state(), ethercat::AlState::kOp) << n;
      EXPECT_TRUE(drive.faults().empty()) << n;
      EXPECT_EQ(drive.statistics().missed, 0U) << n;
    }
  }

  CycleNodeConfig config_;
  std::optional<sim::RandomStream> draw_;
  std::unique_ptr<PlantSegment> plant_;
  std::deque<ethercat::AffineOscillator> crystals_;
  std::unique_ptr<ethercat::Segment> segment_;
  std::unique_ptr<sim::CycleHost> host_;
};
class BridgeTerminal : public WithABridge, public ::testing::WithParamInterface<BusMode> {};
INSTANTIATE_TEST_SUITE_P(Modes, BridgeTerminal,
                         ::testing::Values(BusMode::kExternal, BusMode::kLead));

TEST_P(BridgeTerminal, puts_the_drives_onto_the_time_of_its_other_side) {
  config_.bus_mode = GetParam();
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    crystals_.clear();
    build(seed % 2 == 0 ? kDrives : 0, seed);
    power_on(1.0 + 1e-3 * draw_->uniform());
    ASSERT_TRUE(host_->bring_up()) << seed << ": " << name(node().main().failure().kind);
    EXPECT_LT(std::abs(error_ns(0)), 100'000.0) << "before SYNC0 by one jump";
    cycles(30 * kSecond);
    EXPECT_EQ(node().bus().state, BusClockState::kLocked) << seed;
    double sum = 0.0;
    double worst = 0.0;
    for (int i = 0; i < 5 * kSecond; ++i) {
      cycles(1);
      const double error = error_ns(1 + static_cast<std::size_t>(i) % 3);
      sum += error * error;
      worst = std::max(worst, std::abs(error));
    }
    EXPECT_LT(std::sqrt(sum / (5 * kSecond)), 50.0) << seed;
    EXPECT_LT(worst, 200.0) << seed;
    expect_unharmed();
  }
}

TEST_P(BridgeTerminal, may_lose_its_other_side_and_find_it_elsewhere) {
  config_.bus_mode = GetParam();
  build(kDrives, 7);
  power_on();
  ASSERT_TRUE(host_->bring_up());
  cycles(15 * kSecond);
  ASSERT_EQ(node().bus().state, BusClockState::kLocked);
  plant_->connect(false);
  cycles(10 * kSecond);
  EXPECT_EQ(node().bus().state, BusClockState::kHoldover);
  EXPECT_LT(std::abs(error_ns(1)), 1000.0);
  plant_->connect(true);
  plant_->step(30'000);
  cycles(15 * kSecond);
  EXPECT_EQ(node().bus().state, BusClockState::kLocked);
  EXPECT_LT(std::abs(error_ns(1)), 200.0);
  expect_unharmed();
}

TEST_F(WithABridge, the_offset_is_told_where_nothing_is_moved) {
  build(kDrives, 3);
  power_on();
  ASSERT_TRUE(host_->bring_up());
  cycles(10 * kSecond);
  EXPECT_NEAR(node().bus().dc_to_plant.ns(), error_ns(0), 100.0);
  EXPECT_GT(std::abs(error_ns(0)), 10'000.0) << "the crystals are apart";
  EXPECT_TRUE(node().axes().path().at_full()) << "the terminal is no axis that is waited for";
  expect_unharmed();
}

TEST_F(WithABridge, that_has_no_other_side_ends_the_bring_up) {
  build(2, 4);
  plant_->connect(false);
  config_.main.process.bridge_timeout = Nanoseconds{1'000'000'000};
  power_on();
  EXPECT_FALSE(host_->bring_up());
  EXPECT_EQ(node().main().failure().kind, FailureKind::kBridgeSilent);
  EXPECT_EQ(node().main().failure().position, 2);
}

// A pair of before the gap is of another time: the other side may have been set in the meantime.
TEST_F(WithABridge, that_was_alone_is_believed_after_two_pairs_of_afterwards) {
  constexpr std::uint64_t kHour = 3'600'000'000'000;
  struct Shown {
    bool updated, alone;
    std::uint64_t ahead;
  };
  const std::array kShown{Shown{false, false, kHour}, Shown{false, true, kHour},
                          Shown{true, false, kHour}, Shown{false, false, 2 * kHour}};
  build(0, 8);
  power_on();
  std::size_t next = 0;
  host_->set_way_back([&](const ethercat::FrameView& frame) {
    const ethercat::Datagram inputs = frame[0];
    if (inputs.command() != ethercat::Command::kFprd ||
        inputs.data().size() != ethercat::bridge::kInputSize) {
      return true;
    }
    const Shown shown = kShown[std::min(next++, kShown.size() - 1)];
    const unsigned flags = (shown.updated ? 0x40U : 0U) | (shown.alone ? 0x80U : 0U);
    inputs.data()[1] = static_cast<std::uint8_t>(flags);
    ethercat::store<std::uint64_t>(inputs.data(), 2, 0);
    ethercat::store<std::uint64_t>(inputs.data(), 10, shown.ahead);
    return true;
  });
  ASSERT_TRUE(host_->bring_up()) << name(node().main().failure().kind);
  EXPECT_EQ(next, kShown.size());
  EXPECT_GT((*segment_)[1].dc().system_time(host_->now()), 2 * kHour);
}

TEST_F(WithABridge, that_is_not_on_the_wire_is_refused) {
  build(kDrives + 1, 5);  // beyond the end: five drives
  power_on();
  EXPECT_FALSE(host_->bring_up());
  EXPECT_EQ(node().main().failure().kind, FailureKind::kNoBridge);
  config_.main.process.bridge = 63;
  power_on();
  EXPECT_FALSE(host_->bring_up());
  EXPECT_EQ(node().main().failure().kind, FailureKind::kNoBridge);
}

TEST_F(WithABridge, a_drive_that_is_taken_for_one_refuses_the_stamps) {
  build(kDrives, 6);
  config_.main.process.bridge = 1;
  power_on();
  EXPECT_FALSE(host_->bring_up());
  EXPECT_EQ(node().main().failure().kind, FailureKind::kSdoAborted);
  EXPECT_EQ(node().main().failure().position, 1);
}

}  // namespace
}  // namespace ftcs::node
