// SPDX-License-Identifier: MIT
// The world: a kernel that shows the clocks a test sets.
#include "ftcs/fieldbus/plant_clock.h"

#include <ctime>

#include <gtest/gtest.h>

#include "test/support/fake_kernel.h"

namespace ftcs::daemon {
namespace {

class Clocks : public platform::FakeKernel {
 public:
  [[nodiscard]] std::int64_t clock_ns(clockid_t clock) noexcept override {
    monotonic_ns += 20;
    if (clock >= 16) return auxiliary_ns == 0 ? 0 : monotonic_ns + auxiliary_ns;
    if (clock == CLOCK_TAI) return monotonic_ns + ahead_ns + tai_offset_ns;
    return clock == CLOCK_REALTIME ? monotonic_ns + ahead_ns : monotonic_ns;
  }
  std::int64_t monotonic_ns = 5'000'000'000;
  std::int64_t ahead_ns = 1'700'000'000'000'000'000;
  std::int64_t auxiliary_ns = 0;
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

TEST(PlantClock, shows_an_auxiliary_clock_of_the_kernel) {
  Clocks kernel;
  kernel.auxiliary_ns = 1'700'000'037'000'000'000;
  auto clock = PlantClock::open("aux3", kernel);
  ASSERT_TRUE(clock) << clock.error();
  for (int i = 0; i < 400; ++i) {
    kernel.monotonic_ns += 1'000'000;
    const auto shown = clock->at(FreeRunningTime::from_ns(kernel.monotonic_ns));
    ASSERT_TRUE(shown) << "in each cycle, though it is read eight times a second";
    const std::int64_t expected =
        kernel.monotonic_ns + kernel.auxiliary_ns - 946'684'800'000'000'000;
    EXPECT_NEAR(static_cast<double>(shown->since_epoch().rounded_ns() - expected), 0.0, 200.0);
  }
}

TEST(PlantClock, refuses_an_auxiliary_clock_that_the_kernel_does_not_have) {
  Clocks kernel;
  const auto clock = PlantClock::open("aux0", kernel);
  ASSERT_FALSE(clock);
  EXPECT_NE(clock.error().find("CLOCK_AUX 0 cannot be read: it needs Linux 6.17"),
            std::string::npos);
  EXPECT_FALSE(PlantClock::open("aux8", kernel));
}

TEST(PlantClock, refuses_an_arbitrary_epoch) {
  Clocks kernel;
  kernel.auxiliary_ns = 1'000'000'000;  // since the machine was started
  const auto clock = PlantClock::open("aux1", kernel);
  ASSERT_FALSE(clock);
  EXPECT_NE(clock.error().find("CLOCK_AUX 1 shows a time before the year 2000: an arbitrary epoch"),
            std::string::npos)
      << clock.error();
}

TEST(PlantClock, refuses_what_it_does_not_know) {
  Clocks kernel;
  const auto clock = PlantClock::open("gps", kernel);
  ASSERT_FALSE(clock);
  EXPECT_NE(clock.error().find("'gps' is neither"), std::string::npos);
}

}  // namespace
}  // namespace ftcs::daemon
