// SPDX-License-Identifier: MIT
// The world: frames each millisecond of the reference's crystal, an offset register that rises by
// 300 ns in each, plant time 150 ppm faster than the crystal; stamps that a terminal latched in
// between.
#include "ftcs/node/bridge_clock.h"

#include <cmath>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/work_unit.h"

namespace ftcs::node {
namespace {

constexpr std::int64_t kCycleNs = 1'000'000;
constexpr std::int64_t kStepNs = 300;
constexpr double kPlantPpm = 150.0;
const Rate kTracking = Rate::from_ppm(kPlantPpm);

class BridgeClockTest : public ::testing::TestWithParam<bool> {
 protected:
  BridgeClockTest() { clock_.start(is_reference()); }
  [[nodiscard]] static bool is_reference() { return GetParam(); }
  [[nodiscard]] static double plant_ns(double crystal_ns) {
    return 5e12 + crystal_ns * (1.0 + kPlantPpm * 1e-6);
  }
  /// What the terminal shows of the system time when the crystal shows so much.
  [[nodiscard]] static std::uint64_t internal_ns(double crystal_ns) {
    const double cycles = crystal_ns / kCycleNs;
    const double offset = kStepNs * (is_reference() ? std::ceil(cycles) : cycles);
    return static_cast<std::uint64_t>(std::llround(crystal_ns + offset));
  }
  /// Frame n, and behind it a pair that was latched at this part of the cycle before.
  void frame(std::int64_t n, double part) {
    clock_.on_frame(LocalTime::from_ns(n * (kCycleNs + kStepNs)), n * kStepNs);
    const double crystal_ns = kCycleNs * (static_cast<double>(n) - 1.0 + part);
    toggle_ = !toggle_;
    clock_.on_inputs({toggle_, false, internal_ns(crystal_ns),
                      static_cast<std::uint64_t>(std::llround(plant_ns(crystal_ns)))});
  }
  BridgeClock clock_;
  bool toggle_ = false;
};
INSTANTIATE_TEST_SUITE_P(Terminal, BridgeClockTest, ::testing::Bool());

TEST_P(BridgeClockTest, brings_a_pair_forward_to_the_frame_whatever_the_offset_did) {
  for (std::int64_t n = 1; n < 40; ++n) {
    frame(n, static_cast<double>(n % 10) * 0.1 + 0.02);
    if (n < 3) continue;  // the first pair may be of any age
    const auto plant = clock_.plant(kTracking);
    ASSERT_TRUE(plant);
    EXPECT_NEAR(plant->since_epoch().ns() - 5e12,
                plant_ns(static_cast<double>(n * kCycleNs)) - 5e12, 2.5)
        << n;
  }
}

// Five milliseconds are twenty cycles of 250 us, more than are kept: it was wrong by what had been
// added in the others.
TEST_P(BridgeClockTest, brings_a_pair_forward_that_is_older_than_the_frames_it_remembers) {
  for (std::int64_t n = 30; n < 70; ++n) {
    frame(n, -19.5);
    if (n < 40) continue;
    const auto plant = clock_.plant(kTracking);
    ASSERT_TRUE(plant);
    EXPECT_NEAR(plant->since_epoch().ns() - 5e12,
                plant_ns(static_cast<double>(n * kCycleNs)) - 5e12,
                is_reference() ? kStepNs / 2 + 2.5 : 2.5)
        << n;
  }
}

TEST_P(BridgeClockTest, goes_on_along_the_crystal_for_a_second_without_new_stamps) {
  for (std::int64_t n = 1; n < 10; ++n) frame(n, 0.5);
  for (std::int64_t n = 10; n < 1000; ++n) {
    clock_.on_frame(LocalTime::from_ns(n * (kCycleNs + kStepNs)), n * kStepNs);
  }
  const auto plant = clock_.plant(kTracking);
  ASSERT_TRUE(plant);
  EXPECT_NEAR(plant->since_epoch().ns() - 5e12, plant_ns(999e6) - 5e12, 3.0);
  for (std::int64_t n = 1000; n < 1020; ++n) {
    clock_.on_frame(LocalTime::from_ns(n * (kCycleNs + kStepNs)), n * kStepNs);
  }
  EXPECT_FALSE(clock_.plant(kTracking));
}

TEST_P(BridgeClockTest, believes_no_stamps_that_stand_still_or_are_of_another_time) {
  clock_.on_frame(LocalTime::from_ns(kCycleNs), 0);
  clock_.on_inputs({true, false, 900'000, 77});
  clock_.on_inputs({true, false, 900'000, 77});
  EXPECT_FALSE(clock_.plant(kTracking)) << "no toggle";
  clock_.on_inputs({false, false, 900'000 + 2'000'000'000, 77});
  EXPECT_FALSE(clock_.plant(kTracking)) << "two seconds ahead of the reference";
  clock_.on_inputs({true, true, 900'000, 77});
  EXPECT_FALSE(clock_.plant(kTracking)) << "its other side is not connected";
  clock_.on_inputs({false, false, 900'000, 77});
  EXPECT_FALSE(clock_.plant(kTracking)) << "the first one after it was";
  clock_.on_inputs({true, false, 900'000, 77});
  EXPECT_TRUE(clock_.plant(kTracking));
}

TEST_P(BridgeClockTest, costs_a_cycle_as_much_as_38_divisions_at_most_and_no_heap) {
  constexpr int kCycles = 1'000;
  std::int64_t n = 0;
  Duration sum;
  const test::WorkUnits cost = test::measure_work(40, kCycles, [&] {
    const test::ForbidAllocation guard;
    for (int i = 0; i < kCycles; ++i) {
      frame(++n, 0.3);
      sum += clock_.plant(kTracking).value_or(ReferenceTime{}).since_epoch();
    }
  });
  RecordProperty("ns_a_cycle", static_cast<int>(cost.ns));
  RecordProperty("divisions_a_cycle", static_cast<int>(cost.divisions));
  EXPECT_GT(sum.seconds(), 0.0);
  if (!test::kInstrumented) {
    EXPECT_LT(cost.divisions, 38.0);
  }
}

}  // namespace
}  // namespace ftcs::node
