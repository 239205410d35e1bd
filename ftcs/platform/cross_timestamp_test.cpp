// SPDX-License-Identifier: MIT
// World: a hardware clock 1 ms ahead of CLOCK_REALTIME; a reading over the bus takes 0.8 us.
#include "ftcs/platform/cross_timestamp.h"

#include <gtest/gtest.h>

#include "test/support/fake_clocks.h"

namespace ftcs::platform {
namespace {

struct World {
  World() { kernel.phc.time_ns = 1e6; }
  [[nodiscard]] CrossTimestamper make() { return CrossTimestamper(kernel, *device); }

  FakeClocks kernel;
  Result<ClockDevice, OsError> device =
      ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kRead);
};

TEST(CrossTimestamper, takes_the_best_method_that_the_driver_has) {
  World world;
  world.kernel.precise_errno = 0;
  EXPECT_EQ(world.make().method(), CrossMethod::kPrecise);
  world.kernel.precise_errno = EOPNOTSUPP;
  EXPECT_EQ(world.make().method(), CrossMethod::kExtended);
  world.kernel.extended_errno = ENOTTY;
  EXPECT_EQ(world.make().method(), CrossMethod::kBasic);
  world.kernel.basic_errno = ENOTTY;
  CrossTimestamper none = world.make();
  EXPECT_EQ(none.method(), CrossMethod::kNone);
  EXPECT_FALSE(none.read(5).ok());
}

TEST(CrossTimestamper, every_method_sees_the_same_offset) {
  World world;
  for (const auto method : {CrossMethod::kPrecise, CrossMethod::kExtended, CrossMethod::kBasic}) {
    world.kernel.precise_errno = method == CrossMethod::kPrecise ? 0 : EOPNOTSUPP;
    world.kernel.extended_errno = method == CrossMethod::kExtended ? 0 : EOPNOTSUPP;
    CrossTimestamper cross = world.make();
    ASSERT_EQ(cross.method(), method);
    const auto reading = cross.read(5);
    ASSERT_TRUE(reading.ok());
    EXPECT_NEAR(static_cast<double>(reading->phc_ns - reading->system_ns), 1e6, 2.0);
    EXPECT_EQ(reading->delay_ns, method == CrossMethod::kPrecise ? 0 : 800);
  }
}

TEST(CrossTimestamper, keeps_the_quickest_of_several_readings) {
  World world;
  CrossTimestamper cross = world.make();
  int reading = 0;
  world.kernel.on_clock_read = [&] {
    if (++reading != 4) world.kernel.run(30'000.0);  // an interrupt after the bus access
  };
  const auto best = cross.read(5);
  ASSERT_TRUE(best.ok());
  EXPECT_EQ(best->delay_ns, 800);
  EXPECT_NEAR(static_cast<double>(best->phc_ns - best->system_ns), 1e6, 2.0);
}

TEST(CrossTimestamper, an_incomplete_answer_is_an_error_and_no_reading) {
  for (const bool precise : {true, false}) {
    World world;
    world.kernel.precise_errno = precise ? 0 : EOPNOTSUPP;
    CrossTimestamper cross = world.make();
    world.kernel.short_cross_reads = true;
    const auto reading = cross.read(5);
    ASSERT_FALSE(reading.ok());
    EXPECT_NE(reading.error().message().find("incomplete"), std::string::npos);
    world.kernel.short_cross_reads = false;
    EXPECT_TRUE(cross.read(5).ok());
  }
}

TEST(CrossTimestamper, a_device_that_is_unplugged_is_gone) {
  World world;
  CrossTimestamper cross = world.make();
  world.kernel.phc_gone = true;
  const auto reading = cross.read(5);
  ASSERT_FALSE(reading.ok());
  EXPECT_EQ(reading.error().kind, OsErrorKind::kNoSuchDevice);
}

}  // namespace
}  // namespace ftcs::platform
