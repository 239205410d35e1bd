// SPDX-License-Identifier: MIT
// World: samples of a reference that the oscillator does not follow; offset = local - reference.
#include "ftcs/servo/free_running_servo.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

SyncSample sample_at(std::int64_t origin_ns, std::int64_t free_running_ns, std::int64_t offset_ns) {
  return {ReferenceTime::from_ns(origin_ns), Nanoseconds{30},
          LocalTime::from_ns(origin_ns + 30 + offset_ns),
          FreeRunningTime::from_ns(free_running_ns)};
}

void expect(const ServoUpdate& update, SampleVerdict verdict) {
  EXPECT_EQ(update.verdict, verdict);
  EXPECT_FALSE(update.has_command);
}

TEST(FreeRunningServo, reports_and_never_commands) {
  FreeRunningServo servo;
  expect(servo.update(sample_at(7'000, 1'000, 5), {}), SampleVerdict::kUsed);
  EXPECT_EQ(servo.snapshot().rate_ratio, Rate{});
  expect(servo.update(sample_at(7'150, 1'100, -8), {}), SampleVerdict::kUsed);
  EXPECT_EQ(servo.snapshot().rate_ratio, Rate::from_ratio(1.5));
  EXPECT_EQ(servo.snapshot().offset, Duration{Nanoseconds{-8}});
  EXPECT_EQ(servo.snapshot().path_delay, Duration{Nanoseconds{30}});
  EXPECT_EQ(servo.snapshot().state, ServoState::kUnlocked);
}

TEST(FreeRunningServo, ignores_repetitions) {
  FreeRunningServo servo;
  (void)servo.update(sample_at(7'000, 1'000, 5), {});
  expect(servo.update(sample_at(7'000, 1'000, 9), {}), SampleVerdict::kDuplicate);
  EXPECT_EQ(servo.snapshot().offset, Duration{Nanoseconds{5}});
}

TEST(FreeRunningServo, reports_a_jump_and_goes_on_from_there) {
  FreeRunningServo servo;
  (void)servo.update(sample_at(7'000, 1'000, 5), {});
  expect(servo.update(sample_at(9'000, 1'100, 6), {}), SampleVerdict::kImplausible);
  EXPECT_EQ(servo.snapshot().rate_ratio, Rate{});
  EXPECT_EQ(servo.snapshot().offset, Duration{Nanoseconds{6}});
  expect(servo.update(sample_at(9'125, 1'200, 7), {}), SampleVerdict::kUsed);
  EXPECT_EQ(servo.snapshot().rate_ratio, Rate::from_ratio(1.25));
}

TEST(FreeRunningServo, reset_makes_any_sample_the_first) {
  FreeRunningServo servo;
  (void)servo.update(sample_at(7'000, 1'000, 5), {});
  servo.reset();
  expect(servo.update(sample_at(1'000, 9'000, 5), {}), SampleVerdict::kUsed);
}

TEST(FreeRunningConfig, needs_valid_bounds) {
  EXPECT_EQ(validate(FreeRunningConfig{}), std::nullopt);
  EXPECT_EQ(validate(FreeRunningConfig{{Rate::from_ratio(0.0), Rate::from_ratio(2.0)}}),
            ServoConfigError::kPlausibleRatio);
}

TEST(ServoUpdate, commands_nothing_unless_it_says_so) {
  EXPECT_FALSE(ServoUpdate{}.has_command);
  EXPECT_EQ(ServoUpdate{}.verdict, SampleVerdict::kUsed);
  EXPECT_FALSE(ServoSnapshot{}.offset_known);
}

}  // namespace
}  // namespace ftcs
