// SPDX-License-Identifier: MIT
// The world: a kernel that shows the clocks a test sets.
#include "ftcs/daemon/ethercat/plant_clock.h"

#include <ctime>

#include <gtest/gtest.h>

#include "ftcs/platform/fake_kernel.h"

namespace ftcs::daemon {
namespace {

class Clocks : public platform::FakeKernel {
 public:
  [[nodiscard]] std::int64_t clock_ns(clockid_t clock) noexcept override {
    monotonic_ns += 20;
    if (clock == CLOCK_TAI) return monotonic_ns + ahead_ns + tai_offset_ns;
    return clock == CLOCK_REALTIME ? monotonic_ns + ahead_ns : monotonic_ns;
  }
  std::int64_t monotonic_ns = 5'000'000'000;
  std::int64_t ahead_ns = 1'700'000'000'000'000'000;
  std::int64_t tai_offset_ns = 37'000'000'000;
};

TEST(PlantClock, shows_tai_on_the_epoch_of_distributed_clocks) {
  Clocks kernel;
  auto clock = PlantClock::open("tai", kernel);
  ASSERT_TRUE(clock);
  const auto shown = clock->at(FreeRunningTime::from_ns(5'000'001'000));
  ASSERT_TRUE(shown);
  const std::int64_t expected =
      5'000'001'000 + 1'700'000'000'000'000'000 + 37'000'000'000 - 946'684'800'000'000'000;
  EXPECT_NEAR(static_cast<double>(shown->since_epoch().rounded_ns() - expected), 0.0, 40.0);
}

TEST(PlantClock, refuses_a_tai_that_nobody_set) {
  Clocks kernel;
  kernel.tai_offset_ns = 0;
  const auto clock = PlantClock::open("tai", kernel);
  ASSERT_FALSE(clock);
  EXPECT_NE(clock.error().find("CLOCK_TAI is not set"), std::string::npos);
}

TEST(PlantClock, refuses_what_it_does_not_know) {
  Clocks kernel;
  const auto clock = PlantClock::open("gps", kernel);
  ASSERT_FALSE(clock);
  EXPECT_NE(clock.error().find("'gps' is neither"), std::string::npos);
}

}  // namespace
}  // namespace ftcs::daemon
